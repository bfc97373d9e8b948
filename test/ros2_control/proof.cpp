// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// A generated transmission, its names in NAME and NAMESPACE and the number and the ranges of its
// inputs in INPUTS and RANGES, is proved at so many states: positions both ways, velocities against differences, power,
// nothing allocated, and nothing written that is not finite.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <new>
#include <vector>

#define JOINED_(a, b) a##b
#define JOINED(a, b) JOINED_(a, b)
#define TEXT_(text) #text
#define TEXT(text) TEXT_(text)
#include "plugins.cpp"

namespace
{
const NAMESPACE::Linkage & linkage = NAMESPACE::JOINED(NAME, _linkage);
const lkr_model & model = linkage.model;
constexpr int n = INPUTS;
constexpr double ranges[n][2] = RANGES;
constexpr double nan_ = std::numeric_limits<double>::quiet_NaN();
constexpr double unwritten = 0.123456789;
constexpr double inf = std::numeric_limits<double>::infinity();
// Of this thread: that which logs may allocate.
thread_local bool may_allocate = true;

void check(bool holds, const char * what, long state)
{
  if (!holds) {
    std::printf(TEXT(NAME) ": %s at state %ld\n", what, state);
    std::exit(1);
  }
}

/// The memory of a hardware component, one for states and commands, and a transmission on it.
struct Robot
{
  double actuator[3][n], joint[3][n], status = -1.0;
  NAMESPACE::Transmission transmission;

  static hardware_interface::TransmissionInfo info()
  {
    hardware_interface::TransmissionInfo made;
    made.name = TEXT(NAME);
    for (int i = n - 1; i >= 0; --i) {
      const std::size_t k = static_cast<std::size_t>(i);
      made.actuators.emplace_back();
      made.actuators.back().name = linkage.actuators[k].name;
      made.actuators.back().role = linkage.actuators[k].role;
      made.joints.emplace_back();
      made.joints.back().name = linkage.joints[k].name;
      made.joints.back().role = linkage.joints[k].role;
    }
    return made;
  }

  Robot() : transmission(linkage, info())
  {
    const char * const kinds[3] = {"position", "velocity", "effort"};
    std::vector<transmission_interface::JointHandle> joints;
    std::vector<transmission_interface::ActuatorHandle> actuators;
    joints.emplace_back(TEXT(NAME), "status", &status);
    for (int kind = 2; kind >= 0; --kind) {
      for (int i = 0; i < n; ++i) {
        const std::size_t k = static_cast<std::size_t>(i);
        actuator[kind][i] = joint[kind][i] = 0.0;
        actuators.emplace_back(linkage.actuators[k].name, kinds[kind], &actuator[kind][i]);
        joints.emplace_back(linkage.joints[k].name, kinds[kind], &joint[kind][i]);
      }
    }
    transmission.configure(joints, actuators);
  }
};

/// What of a pose is needed: where both sides are, and how well each tells the inputs.
struct Pose
{
  lkr_point point;
  bool good;
};

Pose pose(const double (&q)[n])
{
  Pose made{};
  std::copy(q, q + n, made.point.q);
  made.good = model.at(1, &made.point) != 0;
  for (int k = 0; k < 2 * n; ++k) {
    // What a change of one position by its size asks of the inputs.
    double change[n] = {};
    change[k / 2] = 1.0 / model.axis[k % 2][k / 2].scale;
    made.good = made.good && lkr_solve(&model, k % 2, &made.point, 0, change) != 0;
    for (int i = 0; i < n; ++i) {
      made.good = made.good && std::fabs(change[i]) * model.input[i].scale < 100.0;
    }
  }
  return made;
}

/// How far apart two positions are, in sizes.
double apart(int side, int i, double one, double other)
{
  const lkr_axis & axis = model.axis[side][i];
  return std::fabs(lkr_wrapped(one - other, 0, axis.turn)) * axis.scale;
}

void at(Robot & robot, const Pose & where)
{
  for (int i = 0; i < n; ++i) {
    robot.actuator[0][i] = where.point.position[0][i];
    robot.actuator[1][i] = 0.0;
    for (int k = 0; k < n; ++k) {
      robot.actuator[1][i] += where.point.rate[0][i][k] * (k + 1);
    }
    robot.actuator[2][i] = 1.0 + i;
  }
  robot.transmission.actuator_to_joint();
}

/// Sample i of the inputs: multiples of irrational numbers, without their whole parts.
void sample(long i, double (&q)[n])
{
  for (int k = 0; k < n; ++k) {
    const double x = static_cast<double>(i) * std::sqrt(1.0 + (k + 1.0) * (k + 1.0));
    q[k] = ranges[k][0] + (ranges[k][1] - ranges[k][0]) * (x - std::floor(x));
  }
}

/// Returns whether the state is far enough from singular poses and ends to be tried.
bool there_and_back(Robot & robot, const double (&q)[n], long state)
{
  constexpr double h = 1e-6;
  double before[n], after[n], beside[n], joints[n], power[2] = {}, size = 1e-300;
  for (int i = 0; i < n; ++i) {
    before[i] = q[i] - h * (i + 1);
    after[i] = q[i] + h * (i + 1);
    beside[i] = q[i] + 1e-2 * (state % 2 ? 1 : -1);
  }
  const Pose here = pose(q), low = pose(before), high = pose(after);
  const Pose near = pose(beside);
  if (!here.good || !low.good || !high.good || !near.good) {
    return false;
  }
  at(robot, here);
  check(robot.status == 0.0, "joints are not OK", state);
  for (int i = 0; i < n; ++i) {
    const double difference = apart(1, i, high.point.position[1][i], low.point.position[1][i]);
    const double rate = std::fabs(robot.joint[1][i]) * model.axis[1][i].scale;
    // What a difference misses grows so next to a pose where the rate is infinite.
    check(std::fabs(difference / (2.0 * h) - rate) <= 1e-7 * (1.0 + rate) + 1e-10 * std::pow(rate, 5),
      "a velocity differs from the difference of positions", state);
    const double in = robot.actuator[1][i] * robot.actuator[2][i];
    const double out = robot.joint[1][i] * robot.joint[2][i];
    power[0] += in - here.point.load[i] * (i + 1);
    power[1] += out;
    size += std::fabs(in) + std::fabs(out) + std::fabs(here.point.load[i] * (i + 1));
    joints[i] = robot.joint[0][i];
  }
  check(std::fabs(power[0] - power[1]) <= 1e-12 * size, "power is lost", state);

  // One memory for both ways: the joints are commanded to be where they are.
  robot.transmission.joint_to_actuator();
  check(robot.status == 0.0, "actuators are not OK", state);
  for (int i = 0; i < n; ++i) {
    check(apart(0, i, robot.actuator[0][i], here.point.position[0][i]) <= 1e-10,
      "an actuator does not come back", state);
    check(std::fabs(robot.actuator[2][i] - 1.0 - i) <= 1e-9, "an effort does not come back", state);
  }

  // The joints are commanded to there from beside it.
  at(robot, near);
  for (int i = 0; i < n; ++i) {
    robot.joint[0][i] = joints[i];
  }
  robot.transmission.joint_to_actuator();
  check(robot.status == 0.0, "it cannot get there from beside it", state);
  robot.transmission.actuator_to_joint();
  for (int i = 0; i < n; ++i) {
    check(apart(1, i, robot.joint[0][i], joints[i]) <= 1e-12, "a joint does not come back", state);
  }
  return true;
}

void hostile(Robot & robot, long state)
{
  const double values[] = {nan_, inf, -inf, 1e300, -1e300, 1e9, 0.0, -0.0, 5e-324, 3.0};
  const long count = static_cast<long>(sizeof values / sizeof *values);
  for (int kind = 0; kind < 3; ++kind) {
    for (int i = 0; i < n; ++i) {
      double (&side)[3][n] = state % 2 ? robot.joint : robot.actuator;
      side[kind][i] = values[(state / 2 + kind * 7 + i * 3 + state / 11) % count];
    }
  }
  double (&other)[3][n] = state % 2 ? robot.actuator : robot.joint;
  for (auto & kind : other) {
    for (double & value : kind) {
      value = unwritten;
    }
  }
  state % 2 ? robot.transmission.joint_to_actuator() : robot.transmission.actuator_to_joint();
  for (auto & kind : other) {
    for (double value : kind) {
      check(std::isfinite(value), "something is written that is not finite", state);
    }
  }
  // What is not commanded is not written.
  for (int kind = 0; state % 2 && kind < 3; ++kind) {
    bool is_commanded = true;
    for (int i = 0; i < n; ++i) {
      is_commanded = is_commanded && std::isfinite(robot.joint[kind][i]);
    }
    for (double value : other[kind]) {
      check(is_commanded || value == unwritten, "what is not commanded is written", state);
    }
  }
}
}  // namespace

// Not inlined: gcc takes what it sees of one of them alone for a mismatch.
[[gnu::noinline]] void * operator new(std::size_t size)
{
  if (!may_allocate) {
    std::abort();
  }
  if (void * memory = std::malloc(size)) {
    return memory;
  }
  throw std::bad_alloc();
}

[[gnu::noinline]] void operator delete(void * memory) noexcept { std::free(memory); }

[[gnu::noinline]] void operator delete(void * memory, std::size_t) noexcept { std::free(memory); }

int main(int argc, char ** argv)
{
  const long states = argc > 1 ? std::atol(argv[1]) : 2000;
  double q[n];
  Robot robot;
  may_allocate = false;
  long tried = 0;
  for (long i = 1; i <= states; ++i) {
    sample(i, q);
    tried += there_and_back(robot, q, i);
  }
  check(2 * tried > states, "most states are singular", tried);
  for (long i = 0; i < states; ++i) {
    hostile(robot, i);
  }
  may_allocate = true;
  std::printf(TEXT(NAME) ": %ld states, %ld of them there and back\n", states, tried);
  return 0;
}
