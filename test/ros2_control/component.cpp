// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0
// A hardware component that loads transmissions from libraries and calls them, with functions for
// the tests: component_made, component_read, component_write, component_ended.
#include <dlfcn.h>

#include <cstdlib>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "transmission_interface/exception.hpp"
#include "transmission_interface/transmission_loader.hpp"

namespace
{
std::string problem;

struct Component
{
  std::shared_ptr<transmission_interface::Transmission> transmission;
};

std::unique_ptr<transmission_interface::TransmissionLoader> loader(
  const char * library, const std::string & type)
{
  void * const opened = dlopen(library, RTLD_NOW | RTLD_LOCAL);
  if (!opened) {
    throw std::runtime_error(dlerror());
  }
  for (int i = 0;; ++i) {
    using Made = transmission_interface::TransmissionLoader * (*)(const char **);
    const auto made = reinterpret_cast<Made>(dlsym(opened, ("stand_in_made_" + std::to_string(i)).c_str()));
    if (!made) {
      throw std::runtime_error("there is no " + type);
    }
    const char * own = nullptr;
    std::unique_ptr<transmission_interface::TransmissionLoader> plugin(made(&own));
    if (own == type) {
      return plugin;
    }
  }
}
}  // namespace

#pragma GCC visibility push(default)
extern "C" {
/// Lines of words apart by tabs: joint NAME ROLE REDUCTION OFFSET, the same of an actuator,
/// parameter NAME VALUE, and joint_handle NAME INTERFACE PLACE, where the place in `memory` is empty
/// for a handle without a value. Returns null for what is refused; see component_problem.
Component * component_made(const char * library, const char * type, const char * lines, double * memory)
try {
  hardware_interface::TransmissionInfo info;
  info.name = "tested";
  std::vector<transmission_interface::JointHandle> joints;
  std::vector<transmission_interface::ActuatorHandle> actuators;
  std::istringstream text(lines);
  for (std::string line; std::getline(text, line);) {
    std::vector<std::string> words;
    std::istringstream rest(line);
    for (std::string word; std::getline(rest, word, '\t');) {
      words.push_back(word);
    }
    words.resize(5);
    double * const place = words[3].empty() ? nullptr : memory + std::atoi(words[3].c_str());
    if (words[0] == "parameter") {
      info.parameters[words[1]] = words[2];
    } else if (words[0] == "joint_handle") {
      joints.emplace_back(words[1], words[2], place);
    } else if (words[0] == "actuator_handle") {
      actuators.emplace_back(words[1], words[2], place);
    } else {
      const auto add = [&words](auto & infos) {
        infos.emplace_back();
        infos.back().name = words[1];
        infos.back().role = words[2];
        infos.back().mechanical_reduction = std::atof(words[3].c_str());
        infos.back().offset = std::atof(words[4].c_str());
      };
      words[0] == "joint" ? add(info.joints) : add(info.actuators);
    }
  }
  auto made = std::make_unique<Component>();
  made->transmission = loader(library, type)->load(info);
  made->transmission->configure(joints, actuators);
  return made.release();
} catch (const transmission_interface::Exception & error) {
  problem = error.what();
  return nullptr;
} catch (const std::exception & error) {
  problem = std::string("not its exception: ") + error.what();
  return nullptr;
}

const char * component_problem() { return problem.c_str(); }

void component_read(Component * component) { component->transmission->actuator_to_joint(); }

void component_write(Component * component) { component->transmission->joint_to_actuator(); }

void component_ended(Component * component) { delete component; }
}
#pragma GCC visibility pop
