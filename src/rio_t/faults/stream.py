"""A bag as a list of messages, for faults to transform: read once, changed in memory, written again."""
import copy

import genpy
import numpy
import rosbag

# PointField.datatype of sensor_msgs to numpy.
DATATYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}


class Message:
    """`kind` is imu, radar or trigger; `record` the recording time [ns]. The content is unpacked when it is first
    needed, for most messages go through unchanged."""
    __slots__ = ("kind", "topic", "record", "_raw", "_content")

    def __init__(self, kind, topic, record, raw=None, content=None):
        self.kind, self.topic, self.record, self._raw, self._content = kind, topic, record, raw, content

    @property
    def content(self):
        """To look at only; `changed` gives a copy to write to."""
        if self._content is None:
            self._content = self._unpacked()
        return self._content

    def _unpacked(self):
        return self._raw[4]().deserialize(self._raw[1])

    def changed(self, record=None):
        """A copy of its own, free to be changed."""
        content = copy.deepcopy(self._content) if self._raw is None else self._unpacked()
        return Message(self.kind, self.topic, self.record if record is None else record, None, content)

    def recorded_at(self, record):
        """The same message, recorded at another time."""
        return Message(self.kind, self.topic, record, self._raw, self._content)

    def write(self, bag):
        time = genpy.Time(self.record // 10**9, self.record % 10**9)
        bag.write(self.topic, self._raw or self._content, time, raw=self._raw is not None)

    @property
    def stamp(self):
        """The stamp in its header [ns]."""
        header = self.content if self.kind == "trigger" else self.content.header
        return header.stamp.to_nsec()

    @stamp.setter
    def stamp(self, nanoseconds):
        header = self._content if self.kind == "trigger" else self._content.header
        header.stamp = genpy.Time(int(nanoseconds) // 10**9, int(nanoseconds) % 10**9)

    # Points of a cloud, as a structured array with the names of the fields.

    def points(self):
        cloud = self.content
        layout = numpy.dtype({"names": [f.name for f in cloud.fields],
                              "formats": [DATATYPES[f.datatype] for f in cloud.fields],
                              "offsets": [f.offset for f in cloud.fields], "itemsize": cloud.point_step})
        return numpy.frombuffer(cloud.data, layout, cloud.width * cloud.height).copy()

    def set_points(self, points):
        cloud = self._content
        cloud.height, cloud.width = 1, len(points)
        cloud.row_step = cloud.point_step * len(points)
        cloud.data = points.tobytes()


def read(path, topics):
    """`topics`: (topic, kind) of what is read, with or without a leading slash. Messages in the order of recording."""
    kind_of = {topic.lstrip("/"): kind for topic, kind in topics}
    with rosbag.Bag(str(path)) as bag:
        kinds = {topic: kind_of[topic.lstrip("/")] for topic in bag.get_type_and_topic_info().topics
                 if topic.lstrip("/") in kind_of}
        return [Message(kinds[topic], topic, time.to_nsec(), raw=raw)
                for topic, raw, time in bag.read_messages(list(kinds), raw=True)]


def write(path, messages):
    with rosbag.Bag(str(path), "w") as bag:
        for message in messages:
            message.write(bag)
