// mcap_reader.mjs FILE RUN: reads FILE with @mcap/core, by its index and as a stream, and compares with the run folder.
import assert from "node:assert";
import {open, readFile} from "node:fs/promises";
import {McapIndexedReader, McapStreamReader} from "@mcap/core";

const [file, run] = process.argv.slice(2);
const handle = await open(file);
const readable = {
  size: async () => BigInt((await handle.stat()).size),
  read: async (offset, size) => {
    const {buffer} = await handle.read({buffer: Buffer.alloc(Number(size)), position: Number(offset)});
    return new Uint8Array(buffer);
  },
};
const lines = async name => (await readFile(`${run}/${name}`, "utf8")).trim().split("\n").length;
const poses = await lines("trajectory.tum");
const reader = await McapIndexedReader.Initialize({readable});
const counts = {};
let last = 0n;
for await (const message of reader.readMessages()) {
  const topic = reader.channelsById.get(message.channelId).topic;
  counts[topic] = (counts[topic] ?? 0) + 1;
  assert(message.logTime >= last, "in order of time");
  last = message.logTime;
  JSON.parse(new TextDecoder().decode(message.data));
}
assert.equal(counts["/sensor"], poses);
assert.equal(counts["/tf"], poses);
assert.equal(counts["/keyframe"], await lines("keyframes.tum"));
assert.ok(counts["/surface"] > 1);  // in parts
const report = JSON.parse(await readFile(`${run}/report.json`, "utf8"));
assert.equal(counts["/tactile"], report.frames.total);
assert.equal(Number(reader.statistics.messageCount), Object.values(counts).reduce((a, b) => a + b));

// A part of the time, by the index.
let some = 0;
for await (const message of reader.readMessages({topics: ["/sensor"], startTime: 1_000_000_000n, endTime: 2_000_000_000n})) {
  assert(message.logTime >= 1_000_000_000n && message.logTime <= 2_000_000_000n);
  ++some;
}
assert(some > 0 && some < poses);

// As a stream, with checksums.
const stream = new McapStreamReader({validateCrcs: true});
stream.append(await readFile(file));
let streamed = 0;
for (let record; (record = stream.nextRecord());) if (record.type === "Message") ++streamed;
assert(stream.done() && BigInt(streamed) === reader.statistics.messageCount);
await handle.close();

// Of a log that knows its time, beside what a robot recorded meanwhile.
const times = async (name, topic) => {
  const bag = new McapStreamReader();
  bag.append(await readFile(`${run}/../${name}`));
  const found = [], topics = new Map();
  for (let record; (record = bag.nextRecord());) {
    if (record.type === "Channel") topics.set(record.id, record.topic);
    if (record.type === "Message" && topics.get(record.channelId) === topic) found.push(record.logTime);
  }
  return found;
};
const robot = new Set(await times("robot.mcap", "/joints")), sensor = await times("timed.mcap", "/sensor");
assert(sensor.length > 20 && sensor.every(time => robot.has(time)));
console.log(counts);
