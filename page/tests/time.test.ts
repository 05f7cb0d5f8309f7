import { describe, expect, test } from "vitest";
import { clockText, indexOf, locate, momentOf, spanOf } from "../src/time";

const episode = { steps: [0, 2, 4, 6], time_s: [0, 1, 3, 4] };

describe("a moment of the clock", () => {
  test.each([
    ["time", -1, 0, 0],
    ["time", 0, 0, 0],
    ["time", 2, 1, 0.5],
    ["time", 3, 2, 0],
    ["time", 99, 3, 0],
    ["step", 3, 1, 0.5],
    ["step", 6, 3, 0],
  ] as const)("by %s, %d lies at index %d and %d of the way to the next step", (axis, at, index, fraction) => {
    expect(locate(episode, axis, at)).toEqual({ index, fraction });
  });

  test("that begins a step is found at that step, by both axes", () => {
    for (const axis of ["time", "step"] as const)
      for (const index of [0, 1, 2, 3]) expect(locate(episode, axis, momentOf(episode, axis, index)).index).toBe(index);
  });

  test("of an episode without steps is its beginning", () => {
    expect(locate({ steps: [], time_s: [] }, "time", 5)).toEqual({ index: 0, fraction: 0 });
  });
});

test("a step that was not recorded is the last one before it", () => expect(indexOf(episode, 5)).toBe(2));

test("two episodes have the span of the longer one", () => {
  expect(spanOf([episode, { steps: [0, 9], time_s: [0.5, 2] }], "time")).toEqual([0, 4]);
  expect(spanOf([episode, { steps: [0, 9], time_s: [0.5, 2] }], "step")).toEqual([0, 9]);
});

test("seconds are written as the game's clock shows them", () => expect([0, 59.99, 61, 3725].map(clockText)).toEqual(["0:00", "0:59", "1:01", "62:05"]));
