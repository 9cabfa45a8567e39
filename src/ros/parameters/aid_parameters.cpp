#include <cmath>

#include "parameter_sections.h"

// Ground vehicle, barometer.
namespace rio_t {

void listAids(ParameterList& list, Config& c) {
  GroundVehicleOptions& vehicle = c.odometry.ground_vehicle;
  list.group("Platform");
  list.choice<Platform>(
      "platform", {{"free", Platform::kFree}, {"ground_vehicle", Platform::kGroundVehicle}},
      c.odometry.platform,
      "free allows any motion. ground_vehicle is a vehicle on wheels: one point of it moves neither sideways "
      "nor upwards. This constraint holds the height. If you know the mounting of the radar to some degrees "
      "only, set estimate_extrinsics: rotation with it. The log and the diagnostics say so if the motion "
      "contradicts the constraint.");
  list.rotation(
      "vehicle_frame_rotation_xyzw", vehicle.T_IV.q_IR,
      "This rotation turns vectors of the vehicle (x forward, y left, z up) into the IMU frame. The estimate "
      "of the rotation starts here. The default is an IMU whose x axis points forward.");
  list.vector3(
      "vehicle_frame_translation", "m", between(-100, 100), vehicle.T_IV.l_I,
      "This point of the vehicle, in the IMU frame, moves only forward. It is the centre of the axle that "
      "does not steer.");
  list.number("vehicle_frame_rotation_sigma", "rad", sigma(M_PI), vehicle.rotation_sigma,
              "The rotation that you give has this standard deviation about each axis.");
  list.number(
      "vehicle_start_slope_sigma", "rad", zeroOr(kLeastSigma, M_PI), vehicle.start_slope_sigma,
      "This is the standard deviation of the slope of the ground on which the vehicle starts at rest. The "
      "estimator levels the vehicle frame with it. The default is a floor in a building. Raise it outdoors. "
      "0 means that the slope is unknown.");
  list.number("vehicle_frame_rotation_noise", "rad/sqrt(s)", sigma(), vehicle.rotation_noise,
              "The rotation may wander by this random walk about each axis, for example if a load or a "
              "bracket moves.");
  list.number("vehicle_sideways_sigma", "m/s", sigma(), vehicle.sideways_sigma,
              "This is the standard deviation of the sideways velocity of the point. Raise it if the wheels "
              "slip.");
  list.number("vehicle_vertical_sigma", "m/s", sigma(), vehicle.vertical_sigma,
              "This is the standard deviation of the upward velocity of the point. Raise it for bumps and "
              "soft springs.");
  list.number("vehicle_gate", "", above(0), vehicle.gate,
              "A velocity is left out if it contradicts the constraint by more than this many standard "
              "deviations.");

  BarometerOptions& barometer = c.odometry.barometer;
  list.group("Barometer");
  list.textOrEmpty(
      "barometer_topic", c.barometer_topic,
      "The barometer publishes sensor_msgs/FluidPressure on this topic, in Pa and stamped in the IMU "
      "clock. If it is empty, there is no barometer.");
  list.number("barometer_noise_density", "m/sqrt(Hz)", above(0, 100), barometer.noise_density,
              "This is the white noise of the height. The estimator takes more if the samples show more.");
  list.number("barometer_drift", "m/sqrt(s)", sigma(), barometer.drift,
              "The bias of the height wanders by this random walk, since the weather and the temperature of "
              "the sensor change. Raise it for flights of an hour.");
  list.number("barometer_temperature", "deg C", between(-60, 60), barometer.temperature,
              "The air has this temperature at the start. An error of three degrees makes a height wrong by "
              "1 %.");
  list.number(
      "barometer_gate", "", atLeast(0), barometer.gate,
      "A height is rejected as a shock of the pressure if it is more than this many standard deviations away "
      "from the estimate. 0 takes every height.");
  list.number(
      "barometer_gate_timeout", "s", above(0), barometer.gate_timeout,
      "If heights are rejected for this time, the pressure moves, and no height is used until the pressure "
      "has been steady for this time. If it is then steady at another value, the bias is estimated again.");
  list.number(
      "barometer_gate_slope", "m/s", above(0), barometer.gate_slope,
      "The pressure also moves if the heights slope by more than this against the motion that the radar "
      "shows, beyond what noise explains. Raise it if the radar may be wrong by more: a mounting that is "
      "wrong by 2 degrees makes 0.07 m/s at 2 m/s.");
}

}  // namespace rio_t
