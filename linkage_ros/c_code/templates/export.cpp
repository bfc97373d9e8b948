PLUGINLIB_EXPORT_CLASS(
  @namespace@::@class@Loader, transmission_interface::TransmissionLoader)
