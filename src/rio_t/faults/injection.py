"""The faults: each takes the messages of a bag and returns them with the fault in it.

`Site` says where: `begin` and `end` of the fault in seconds after the first message, as recorded. Faults that are drawn
take `site.random`, which starts anew for each case, so that a case is the same in every run.
"""
import collections
import dataclasses
import itertools

import numpy

DOPPLER_FIELDS = ("v_doppler_mps", "velocity", "doppler")
G = 9.81


@dataclasses.dataclass
class Site:
    origin: int           # [ns] recording time of the first message
    begin: float          # [s] after origin
    end: float
    random: numpy.random.RandomState

    def covers(self, message):
        return self.begin <= self.seconds(message) < self.end

    def seconds(self, message):
        return 1e-9 * (message.record - self.origin)


def nanoseconds(seconds):
    return int(round(1e9 * seconds))


def edit(messages, kind, where, change):
    """Calls `change(copy)` for each message of `kind` for which `where(message)` holds."""
    result = []
    for message in messages:
        if message.kind == kind and where(message):
            message = message.changed()
            change(message)
        result.append(message)
    return result


def drop(messages, kind, where):
    return [m for m in messages if not (m.kind == kind and where(m))]


def in_order_of_recording(messages):
    return sorted(messages, key=lambda m: m.record)


def doppler_field(points):
    return next(name for name in DOPPLER_FIELDS if name in points.dtype.names)


def edit_points(messages, site, change):
    """Replaces the points of each scan that the fault covers by `change(points)`."""
    return edit(messages, "radar", site.covers, lambda m: m.set_points(change(m.points())))


def edit_imu(messages, site, accel=None, gyro=None):
    """Replaces the vectors of each sample that the fault covers by `accel(vector)` and `gyro(vector)`."""
    def change(message):
        for of, function in ((message.content.linear_acceleration, accel), (message.content.angular_velocity, gyro)):
            if function:
                of.x, of.y, of.z = map(float, function(vector(of)))
    return edit(messages, "imu", site.covers, change)


def vector(of):
    return numpy.array([of.x, of.y, of.z])


def repeats(kind, every=None):
    """The driver publishes the message before again, under a new header: always, or but for one of `every`."""
    def inject(messages, site):
        new, count, result = None, 0, []
        for m in messages:
            if m.kind == kind:
                count += 1
                if new is not None and site.covers(m) and (every is None or count % every):
                    again = new.changed(m.record)
                    again.content.header = m.content.header
                    m = again
                else:
                    new = m
            result.append(m)
        return result
    return inject


# --- Radar ---


def nothing(messages, site):
    return messages


def radar_blackout(messages, site):
    return drop(messages, "radar", site.covers)


def scans_dropped(share):
    return lambda messages, site: drop(messages, "radar", lambda m: site.covers(m) and site.random.rand() < share)


def scans_of(points):
    """Scans with at most that many points: drawn from 0 to `points`."""
    def keep(all_points, site):
        wanted = site.random.randint(0, points + 1)
        return all_points[site.random.permutation(len(all_points))[:wanted]]
    return lambda messages, site: edit_points(messages, site, lambda p: keep(p, site))


def spoiled_points(share):
    """That share of the points is not a number, infinite, or at zero range, position or Doppler."""
    def spoil(points, site):
        doppler = (doppler_field(points),)
        kinds = ("x", numpy.nan), ("y", numpy.inf), (doppler, -numpy.inf), (doppler, numpy.nan), ("xyz", 0.0)
        for k in numpy.flatnonzero(site.random.rand(len(points)) < share):
            fields, value = kinds[site.random.randint(5)]
            for field in fields:
                points[k][field] = value
        return points
    return lambda messages, site: edit_points(messages, site, lambda p: spoil(p, site))


def outliers(share):
    """That share of the points has any Doppler."""
    def spoil(points, site):
        hit = site.random.rand(len(points)) < share
        points[doppler_field(points)][hit] = site.random.uniform(-4.0, 4.0, hit.sum())
        return points
    return lambda messages, site: edit_points(messages, site, lambda p: spoil(p, site))


def half_the_view_moves(messages, site):
    """All that is seen on one side, half of the points, moves as one, e.g. a train."""
    velocity = numpy.array((1.2, 0.8, 0.0))  # [m/s]
    def spoil(points):
        xyz = numpy.stack([points[a] for a in "xyz"], axis=1).astype(float)
        direction = xyz / numpy.maximum(numpy.linalg.norm(xyz, axis=1), 1e-6)[:, None]
        # Sideways is the axis along which the points scatter to both sides of zero.
        side = min((0, 1), key=lambda a: abs(numpy.median(direction[:, a])))
        moving = direction[:, side] > numpy.median(direction[:, side])
        points[doppler_field(points)][moving] += (direction @ velocity)[moving]
        return points
    return edit_points(messages, site, spoil)


def all_ghosts(messages, site):
    """Every point anywhere in the view with any Doppler."""
    def spoil(points):
        n = len(points)
        order = site.random.permutation(n)
        for axis in "xyz":
            points[axis] = points[axis][order] * site.random.uniform(0.2, 1.5, n)
        points[doppler_field(points)] = site.random.uniform(-4.0, 4.0, n)
        return points
    return edit_points(messages, site, spoil)


# --- Stamps of scans and triggers ---


def edit_stamps(kinds, every, stamp):
    """Sets the stamp of every nth message of these kinds to `stamp(message)`."""
    def inject(messages, site):
        for kind in kinds:
            count = itertools.count()
            messages = edit(messages, kind, lambda m: site.covers(m) and next(count) % every == 0,
                            lambda m: setattr(m, "stamp", stamp(m)))
        return messages
    return inject


def stamps_shifted(kinds, seconds, every=1):
    return edit_stamps(kinds, every, lambda m: max(0, m.stamp + nanoseconds(seconds)))


def stamp_zero(kind, every=1):
    return edit_stamps((kind,), every, lambda m: 0)


def scans_before_imu(messages, site):
    """The IMU starts only at the end of the fault."""
    return drop(messages, "imu", site.covers)


def triggers_lost(share):
    return lambda messages, site: drop(messages, "trigger", lambda m: site.covers(m) and site.random.rand() < share)


def triggers_doubled(messages, site):
    """Each trigger comes again 20 ms later, with a stamp of its own."""
    result = list(messages)
    for m in messages:
        if m.kind == "trigger" and site.covers(m):
            again = m.changed(m.record + nanoseconds(0.02))
            again.stamp = m.stamp + nanoseconds(0.02)
            result.append(again)
    return in_order_of_recording(result)


def frame_id_empty(messages, site):
    def clear(m):
        m.content.header.frame_id = ""
    for kind in ("imu", "radar"):
        messages = edit(messages, kind, site.covers, clear)
    return messages


# --- IMU ---


def imu_gap(messages, site):
    return drop(messages, "imu", site.covers)


def imu_doubled(messages, site):
    """Each sample comes twice."""
    return [copy for m in messages for copy in ((m, m) if m.kind == "imu" and site.covers(m) else (m,))]


def imu_reordered(messages, site):
    """Samples come in blocks of four, backwards."""
    result = list(messages)
    places = [i for i, m in enumerate(messages) if m.kind == "imu" and site.covers(m)]
    for k in range(0, len(places) - 3, 4):
        block = places[k:k + 4]
        for i, j in zip(block, reversed(block)):
            result[i] = messages[j].recorded_at(messages[i].record)
    return result


def imu_stamps_repeated(messages, site):
    """Every second sample carries the stamp of the one before it."""
    last = [None, 0]
    def repeat(m):
        last[1] += 1
        if last[1] % 2 == 0 and last[0] is not None:
            m.stamp = last[0]
        last[0] = m.stamp
    return edit(messages, "imu", site.covers, repeat)


def axis_freezes(sensor):
    """The x axis of "gyro" or "accel" stays at the reading that it has when the fault begins."""
    def inject(messages, site):
        frozen = []
        def freeze(of):
            frozen.append(of[0])
            of[0] = frozen[0]
            return of
        return edit_imu(messages, site, **{sensor: freeze})
    return inject


def gyro_corrupt():
    """The first three samples of each second have any rates of up to 17 rad/s, a thousand degrees per second."""
    def inject(messages, site):
        samples = collections.Counter()
        def comes_first(message):
            second = int(site.seconds(message))
            samples[second] += 1
            return site.covers(message) and samples[second] <= 3
        def spoil(message):
            of = message.content.angular_velocity
            of.x, of.y, of.z = map(float, site.random.uniform(-17.0, 17.0, 3))
        return edit(messages, "imu", comes_first, spoil)
    return inject


def imu_saturated(accel=False, gyro=False):
    """The range of all axes ends at 0.6 of what the motion of this bag exceeds in a hundredth of the time. For the
    accelerometer, this is the motion beyond gravity, on the axis that is upright at rest."""
    share = 0.6
    def inject(messages, site):
        samples = [m for m in messages if m.kind == "imu"]
        accels = numpy.array([vector(m.content.linear_acceleration) for m in samples])
        gyros = numpy.array([vector(m.content.angular_velocity) for m in samples])
        rest = accels[:200].mean(axis=0)
        up = numpy.abs(rest).argmax()  # where gravity leaves the least of the range
        accel_limit = abs(rest[up]) + share * numpy.percentile(numpy.abs(accels[:, up] - rest[up]), 99)
        gyro_limit = share * numpy.percentile(numpy.abs(gyros).max(axis=1), 99)
        return edit_imu(messages, site, accel and (lambda a: numpy.clip(a, -accel_limit, accel_limit)),
                        gyro and (lambda w: numpy.clip(w, -gyro_limit, gyro_limit)))
    return inject


def imu_scaled(accel=1.0, gyro=1.0):
    return lambda messages, site: edit_imu(messages, site, lambda a: accel * a, lambda w: gyro * w)


def imu_turned(matrix):
    """Another frame than the calibration says: both sensors, v -> matrix v."""
    turn = numpy.array(matrix, dtype=float)
    return lambda messages, site: edit_imu(messages, site, lambda a: turn @ a, lambda w: turn @ w)


def imu_without_gravity(messages, site):
    """The driver removed gravity, as linear acceleration of some fused outputs."""
    rest = [m for m in messages if m.kind == "imu"][:200]
    middle = numpy.mean([vector(m.content.linear_acceleration) for m in rest], axis=0)
    return edit_imu(messages, site, lambda a: a - middle)


def imu_not_finite(share):
    def inject(messages, site):
        def spoil(m):
            spoiled = m.content.linear_acceleration if site.random.rand() < 0.5 else m.content.angular_velocity
            setattr(spoiled, "xyz"[site.random.randint(3)], (numpy.nan, numpy.inf)[site.random.randint(2)])
        return edit(messages, "imu", lambda m: site.covers(m) and site.random.rand() < share, spoil)
    return inject


# --- The whole recording ---


def clock_jump(seconds, stamps=True, record=True):
    """From the beginning of the fault on, the clocks of stamps and records (or of one of them) run `seconds` ahead."""
    shift = nanoseconds(seconds)
    def inject(messages, site):
        result = []
        for m in messages:
            if site.seconds(m) >= site.begin:
                if stamps:
                    m = m.changed()
                    if m.stamp != 0:
                        m.stamp = m.stamp + shift
                if record:
                    m = m.recorded_at(m.record + shift)
            result.append(m)
        return result
    return inject


def bag_loop(messages, site):
    """The bag is played to the fault and then from the start again: stamps jump back, the recording goes on."""
    until = [m for m in messages if site.seconds(m) < site.begin]
    length = until[-1].record - until[0].record + nanoseconds(0.005)
    return until + [m.recorded_at(m.record + length) for m in messages]


def started_late(messages, site):
    """The recording begins in the middle of the motion."""
    return [m for m in messages if site.seconds(m) >= site.begin]
