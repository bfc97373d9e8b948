// Copyright 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// Swings a slotted lever evenly to and fro: a hobby servo turns the pin that moves it.
// lever.h is printed by:
//   python -m linkage_ros.c_code lever.yaml --output lever --float > lever.h

#include <Servo.h>
#include "lever.h"

const int PIN = 9;
const float SWING = 0.4;    // rad to either side; the lever reaches 0.46
const float PERIOD = 3.0;   // s
const float MIDDLE = 90.0;  // degrees of the servo where its arm points away from the pivot

Servo servo;
float crank = 0.0;

void setup() {
  servo.attach(PIN);
}

void loop() {
  float wanted = SWING * sin(2.0 * PI * millis() / (1000.0 * PERIOD));
  // Next to where the crank is; if the lever cannot get there, the servo stays.
  if (lever_crank_for_angle_lever(wanted, crank, &crank)) {
    servo.writeMicroseconds(map(1000.0 * (MIDDLE + crank * RAD_TO_DEG), 0, 180000, 544, 2400));
  }
  delay(20);
}
