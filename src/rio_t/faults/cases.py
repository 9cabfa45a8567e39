"""The cases of the campaign on recorded bags: a fault, when it is there, and what must happen.

The bounds. The usual errors are the largest of the causal output without a fault: 0.3 m/s, 0.6 m. Without radar the IMU
carries the estimate: an error of the tilt of half a degree is an acceleration of 0.1 m/s^2, so T seconds add up to 0.1 T m/s
and 0.05 T^2 m. Without IMU for T seconds, the platform may turn by 45 degrees and more unseen: forward motion becomes
sideways motion, and gravity adds to it until the next scan. Radar and gravity bring velocity and tilt back. The heading stays
lost, which its sigma says, and turns the rest of the path. This adds 1.5 T m/s and 2 T m.
Scans with errors must not cost more than missing scans.
"""
import dataclasses
from typing import Callable

from . import injection as inject
from .expectations import Refuses, RefusesOrReports, Survives

VELOCITY, POSITION = 0.3, 0.6  # [m/s, m] the usual errors, above
ALWAYS = (0.0, 1e6)            # [s] in the whole bag


@dataclasses.dataclass
class Case:
    name: str
    fault: Callable            # (messages, site) -> messages
    expect: object
    when: tuple = (20.0, 25.0)  # [s] begin and end of the fault
    settings: tuple = ()       # of rio_t_bag, key=value
    bags: tuple = ("simulated", "real")
    shift: float = 0.0         # [s] by which the stamps of the output jump

    @property
    def must(self):
        return self.expect.words()


def without_radar(seconds, **more):
    return Survives(VELOCITY + 0.1 * seconds, POSITION + 0.05 * seconds**2, **more)


def without_imu(seconds, **more):
    return Survives(VELOCITY + 1.5 * seconds, POSITION + 2.0 * seconds, **more)


def lasting(seconds, begin=20.0):
    return (begin, begin + seconds)


CASES = [
    Case("no_fault", inject.nothing, Survives(VELOCITY, POSITION)),

    # --- Radar
    Case("radar_blackout_1s", inject.radar_blackout, without_radar(1, counted=("radar_gap",), grows=1.2), lasting(1)),
    Case("radar_blackout_5s", inject.radar_blackout, without_radar(5, counted=("radar_gap",), grows=2), lasting(5)),
    Case("radar_blackout_20s", inject.radar_blackout, without_radar(20, counted=("radar_gap",), grows=5),
         lasting(20, 14.0)),
    Case("scans_dropped_50", inject.scans_dropped(0.5), Survives(VELOCITY, POSITION), ALWAYS),
    Case("scans_repeated", inject.repeats("radar", every=2), Survives(VELOCITY, POSITION, counted=("scan_repeated",)), ALWAYS),
    Case("scans_empty", inject.scans_of(0), without_radar(3, counted=("too_few_points",), grows=1.2), lasting(3)),
    # The window uses such scans: one or two points at a time show most of the velocity.
    Case("scans_of_1_or_2_points", inject.scans_of(2), without_radar(5, counted=("too_few_points",), grows=1.5)),
    Case("points_not_finite", inject.spoiled_points(0.5), Survives(VELOCITY, POSITION, counted=("points_not_finite",)),
         ALWAYS),
    Case("points_all_not_finite", inject.spoiled_points(1.0),
         without_radar(3, counted=("points_not_finite", "too_few_points")), lasting(3)),
    Case("outliers_40", inject.outliers(0.4), Survives(VELOCITY, POSITION), ALWAYS),
    Case("half_the_view_moves", inject.half_the_view_moves, without_radar(5)),
    Case("ghosts_only_3s", inject.all_ghosts,
         without_radar(3, counted=("too_few_inliers|innovation|sigma_too_large|ill_conditioned",), grows=1.2), lasting(3)),

    # --- Stamps of the scans
    Case("scan_before_imu", inject.scans_before_imu, Survives(VELOCITY, POSITION, counted=("before_initialization",)),
         (0.0, 1.0)),
    Case("scan_in_the_future", inject.stamps_shifted(("radar", "trigger"), 1000.0, every=3),
         Survives(VELOCITY, POSITION, counted=("stamp_ahead_of_imu",))),
    Case("scan_in_the_past", inject.stamps_shifted(("radar", "trigger"), -10.0, every=3),
         Survives(VELOCITY, POSITION, counted=("older_than_window",))),
    Case("scan_stamp_zero", inject.stamp_zero("radar", every=3), Survives(VELOCITY, POSITION, counted=("stamp_zero",)),
         bags=("simulated",)),
    Case("scan_stamps_all_zero", inject.stamp_zero("radar"), Refuses("stamp in the header is zero.*trigger.*arrival"),
         ALWAYS, bags=("simulated",)),
    Case("trigger_missing", inject.triggers_lost(0.3), Survives(VELOCITY, POSITION, counted=("trigger_missing",)),
         settings=("stamp_source=trigger",)),
    Case("trigger_all_missing", inject.triggers_lost(1.1), without_radar(5, counted=("trigger_missing",)),
         settings=("stamp_source=trigger",)),
    Case("trigger_doubled", inject.triggers_doubled, Survives(VELOCITY, POSITION), settings=("stamp_source=trigger",)),
    Case("frame_id_empty", inject.frame_id_empty, Survives(VELOCITY, POSITION), ALWAYS),

    # --- IMU
    Case("imu_gap_0.05s", inject.imu_gap, Survives(VELOCITY, POSITION, counted=("imu_gap",)), lasting(0.05)),
    Case("imu_gap_0.5s", inject.imu_gap, without_imu(0.5, counted=("imu_gap",), grows=1.5), lasting(0.5)),
    Case("imu_gap_2s", inject.imu_gap, without_imu(2, counted=("imu_gap",), grows=3), lasting(2)),
    Case("imu_doubled", inject.imu_doubled, Survives(VELOCITY, POSITION, counted=("imu_out_of_order",))),
    Case("imu_reordered", inject.imu_reordered, Survives(VELOCITY, POSITION, counted=("imu_out_of_order",))),
    Case("imu_stamps_repeated", inject.imu_stamps_repeated, Survives(VELOCITY, POSITION, counted=("imu_out_of_order",))),
    Case("imu_polled_too_often", inject.repeats("imu", every=2), Survives(VELOCITY, POSITION, counted=("imu_repeated",)), ALWAYS),
    Case("imu_repeats_0.3s", inject.repeats("imu"), without_imu(0.3, counted=("imu_repeated",), grows=1.2),
         lasting(0.3)),
    Case("accel_axis_freezes_0.3s", inject.axis_freezes("accel"),
         without_imu(0.3, counted=("imu_stuck|imu_saturated",)), lasting(0.3)),
    Case("gyro_axis_freezes_0.3s", inject.axis_freezes("gyro"), without_imu(0.3, counted=("imu_stuck|imu_saturated",)),
         lasting(0.3)),
    Case("gyro_corrupt", inject.gyro_corrupt(), Survives(VELOCITY, POSITION, counted=("imu_stuck",))),
    Case("imu_stamp_of_one_ahead", inject.stamps_shifted(("imu",), 100.0),
         Survives(VELOCITY, POSITION, counted=("imu_stamp_jump",)), lasting(0.004)),
    Case("imu_stamp_of_one_behind", inject.stamps_shifted(("imu",), -100.0),
         Survives(VELOCITY, POSITION, counted=("imu_stamp_jump|imu_out_of_order",)), lasting(0.004)),
    Case("imu_stamps_jump_forward", inject.stamps_shifted(("imu",), 10.0),
         Survives(5.0, 8.0, counted=("imu_stamp_jump",), world_goes_on=False), lasting(0.5)),
    Case("imu_stamps_jump_back", inject.stamps_shifted(("imu",), -10.0),
         Survives(5.0, 8.0, counted=("imu_stamp_jump|imu_out_of_order",), world_goes_on=False), lasting(0.5)),
    Case("imu_not_finite", inject.imu_not_finite(0.2), Survives(VELOCITY, POSITION, counted=("imu_not_finite",))),
    # An axis that lacks 3 m/s^2 from the last measurement to the output, up to 0.3 s, costs 1 m/s.
    Case("imu_saturated_accel", inject.imu_saturated(accel=True), Survives(1.0, 3.0, counted=("imu_saturated",)), ALWAYS),
    Case("imu_saturated_gyro", inject.imu_saturated(gyro=True), Survives(1.0, 5.0, counted=("imu_saturated",)), ALWAYS),
    Case("imu_in_g", inject.imu_scaled(accel=1.0 / inject.G), Refuses("m/s\\^2.*9.81|9.81.*m/s\\^2"), ALWAYS),
    Case("imu_in_degrees", inject.imu_scaled(gyro=57.29578), RefusesOrReports("rad/s"), ALWAYS),
    Case("imu_gravity_removed", inject.imu_without_gravity, Refuses("gravity (instead of )?9.81"), ALWAYS),
    # Each of these IMUs is at rest when it is at rest: only the radar and the motion can tell.
    Case("imu_gravity_flipped", inject.imu_scaled(accel=-1.0), RefusesOrReports("gravity|units"), ALWAYS),
    Case("imu_axes_turned", inject.imu_turned([[0, 0, 1], [1, 0, 0], [0, 1, 0]]), RefusesOrReports("gravity|extrinsics"), ALWAYS),

    # --- Clocks, bags, starts
    Case("clock_jump_forward", inject.clock_jump(30.0),
         Survives(5.0, 8.0, counted=("imu_clock_restart",), world_goes_on=False), lasting(0), shift=30.0),
    Case("clock_jump_back", inject.clock_jump(-5.0, record=False),
         Survives(5.0, 8.0, counted=("imu_clock_restart",), world_goes_on=False), lasting(0), shift=-5.0),
    Case("clock_step_back_50ms", inject.clock_jump(-0.05, record=False),
         Survives(1.0, 2.0, counted=("imu_clock_back",)), lasting(0), shift=-0.05),
    Case("recorder_clock_jump", inject.clock_jump(30.0, stamps=False), Survives(5.0, 8.0, world_goes_on=False),
         lasting(0), settings=("stamp_source=arrival",)),
    Case("bag_loop", inject.bag_loop, Survives(VELOCITY, POSITION, counted=("imu_clock_restart",), world_goes_on=False),
         lasting(0, 30.0)),
    Case("started_in_motion", inject.started_late, Survives(1.0, 2.0, world_goes_on=False), lasting(0)),
]
