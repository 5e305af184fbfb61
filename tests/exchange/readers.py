"""Small readers of what `gelslam export` writes, from the formats' specifications. They share nothing with the program."""
import base64
import json
import re
import struct
import zlib


def read_tum(text):
    return [tuple(map(float, line.split())) for line in text.splitlines()]


def read_page(text):
    """(data, PLY bytes) embedded in a page."""
    data = re.search(r'<script type="application/json" id="run">(.*?)</script>', text, re.S)[1]
    ply = re.search(r'<script type="text/plain" id="mesh">(.*?)</script>', text, re.S)[1]
    return json.loads(data), base64.b64decode(ply, validate=True)


def robot_bag(topic, times_ns):
    """The bytes of an MCAP file as a robot's recorder writes it, without chunks and summary: a JSON message for each time."""
    def record(opcode, *parts):
        content = b"".join(parts)
        return struct.pack("<BQ", opcode, len(content)) + content

    def string(text):
        return struct.pack("<I", len(text)) + text.encode()

    messages = [record(5, struct.pack("<HIQQ", 1, i, t, t), b'{"joint": %d}' % i) for i, t in enumerate(times_ns)]
    return b"".join([Mcap.MAGIC, record(1, string(""), string("robot")), record(4, struct.pack("<HH", 1, 0), string(topic), string("json"), struct.pack("<I", 0)),
                     *messages, record(15, struct.pack("<I", 0)), record(2, struct.pack("<QQI", 0, 0, 0)), Mcap.MAGIC])


class Mcap:
    """An MCAP file, read twice: from front to back, and by its summary. Checks every checksum and offset."""

    MAGIC = b"\x89MCAP0\r\n"

    def __init__(self, data):
        self.data, self.schemas, self.channels, self.messages = data, {}, {}, []
        assert data.startswith(self.MAGIC) and data.endswith(self.MAGIC)
        self.chunks, self.indexed, self.summary, footer = {}, {}, [], None
        position, in_summary = len(self.MAGIC), False
        while position < len(data) - len(self.MAGIC):
            opcode, length = struct.unpack_from("<BQ", data, position)
            content, start = data[position + 9:position + 9 + length], position
            position += 9 + length
            if in_summary:
                self.summary.append((start, opcode, content))
            elif opcode == 0x0F:
                assert struct.unpack("<I", content)[0] == zlib.crc32(data[:start]), "of the data section"
                in_summary = True
            elif opcode == 6:
                self._chunk(start, content)
            elif opcode == 7:
                self._message_index(start, content)
            else:
                self._record(opcode, content)
        self._check_summary()

    @staticmethod
    def _string(content, at):
        (length,) = struct.unpack_from("<I", content, at)
        return content[at + 4:at + 4 + length], at + 4 + length

    def _record(self, opcode, content):
        if opcode == 3:
            (number,) = struct.unpack_from("<H", content)
            name, at = self._string(content, 2)
            encoding, at = self._string(content, at)
            schema, at = self._string(content, at)
            assert encoding == b"jsonschema" and at == len(content) and number > 0
            self.schemas[number] = (name.decode(), json.loads(schema))
        elif opcode == 4:
            number, schema = struct.unpack_from("<HH", content)
            topic, at = self._string(content, 4)
            encoding, at = self._string(content, at)
            assert encoding == b"json" and schema in self.schemas
            self.channels[number] = (topic.decode(), self.schemas[schema][0])
        else:
            assert opcode in (1, 5), opcode

    def _chunk(self, start, content):
        first, last, size, crc = struct.unpack_from("<QQQI", content)
        compression, at = self._string(content, 28)
        (length,) = struct.unpack_from("<Q", content, at)
        records = content[at + 8:]
        assert compression == b"" and length == size == len(records) and crc == zlib.crc32(records)
        self.entries, at, times = [], 0, []
        while at < len(records):
            opcode, length = struct.unpack_from("<BQ", records, at)
            assert opcode == 5
            channel, sequence, log_time, publish_time = struct.unpack_from("<HIQQ", records, at + 9)
            message = json.loads(records[at + 31:at + 9 + length])
            assert log_time == publish_time and channel in self.channels
            self.messages.append((self.channels[channel][0], log_time, message))
            self.entries.append((channel, log_time, at))
            times.append(log_time)
            at += 9 + length
        assert (first, last) == (min(times), max(times))
        self.chunk_start = start
        self.chunks[start] = (first, last, 9 + len(content), size)

    def _message_index(self, start, content):
        channel, length = struct.unpack_from("<HI", content)
        assert len(content) == 6 + length
        entries = [(channel, *e) for e in struct.iter_unpack("<QQ", content[6:])]
        assert sorted(entries) == sorted(e for e in self.entries if e[0] == channel)
        self.indexed.setdefault(self.chunk_start, {})[channel] = start

    def _check_summary(self):
        start, opcode, footer = self.summary.pop()
        summary_start, offsets_start, crc = struct.unpack("<QQI", footer)
        assert opcode == 2 and crc == zlib.crc32(self.data[summary_start:start + 9 + 16])
        groups, chunks = {}, {}
        for at, opcode, content in self.summary:
            if opcode == 14:
                assert at >= offsets_start
                group, begin, length = struct.unpack("<BQQ", content)
                assert groups.pop(group) == [begin, length]
                continue
            groups.setdefault(opcode, [at, 0])[1] += 9 + len(content)
            assert summary_start <= at < offsets_start
            if opcode == 8:
                first, last, chunk, length, size = struct.unpack_from("<QQQQI", content)
                offsets = {c: o for c, o in struct.iter_unpack("<HQ", content[36:36 + size])}
                assert offsets == self.indexed[chunk]
                chunks[chunk] = (first, last, length, struct.unpack("<Q", content[-8:])[0])
            elif opcode == 11:
                count, schemas, channels, _, _, chunk_count, first, last = struct.unpack_from("<QHIIIIQQ", content)
                times = [t for _, t, _ in self.messages]
                assert (count, schemas, channels) == (len(times), len(self.schemas), len(self.channels))
                assert (chunk_count, first, last) == (len(self.chunks), min(times), max(times))
                counts = {self.channels[c][0]: n for c, n in struct.iter_unpack("<HQ", content[46:])}
                assert counts == {topic: len(self.of(topic)) for topic, _ in self.channels.values()}
            else:
                assert opcode in (3, 4)
                self._record(opcode, content)
        assert not groups and chunks == self.chunks, "every group and chunk is indexed"

    def of(self, topic):
        """[(time in ns, message)] of a topic, in the file's order."""
        return [(t, m) for name, t, m in self.messages if name == topic]
