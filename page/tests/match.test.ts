import { effect } from "@preact/signals";
import { afterEach, expect, test, vi } from "vitest";
import { Match } from "../src/match";
import type { RecordingProgress, RunView, Timeline } from "../src/wire";

const progress = (indexed: number, steps: number): RecordingProgress => ({ kind: "progress", episode: 0, steps, indexed, live: false, lag_s: null });
const run = (indexed: number) => ({ line: { live: false }, sides: ["blue"], agents: [], episodes: [{ episode: 0 }], indexed }) as unknown as RunView;
const timeline = (steps: number) =>
  ({ steps: [...Array(steps).keys()], time_s: [...Array(steps).keys()], curves: [] }) as unknown as Timeline;

/** Answers of a server, by how a path ends; what is not there is an error. */
let answers: Record<string, unknown> = {};

vi.mock("../src/api", () => ({
  get: async (path: string) => {
    const end = Object.keys(answers).find((known) => path.endsWith(known));
    if (end === undefined) throw new Error(path);
    return answers[end];
  },
}));

afterEach(() => void (answers = {}));

test("a match is not read to its end before its last steps are there", async () => {
  answers = { "runs/x": run(0.5), "/timeline": timeline(2) };
  const match = new Match("x", 0);
  await match.open();
  const seen: [grows: boolean, steps: number][] = [];
  effect(() => void seen.push([match.grows(), match.timeline.value?.steps.length ?? 0]));
  answers = { "runs/x": run(1), "/timeline": timeline(5) };
  await match.grow(progress(1, 5));
  expect(seen).toEqual([[true, 2], [false, 5]]);
  match.close();
});

test("a match whose episode has not begun takes its steps when it has", async () => {
  answers = { "runs/x": { ...run(0.1), episodes: [] } };
  const match = new Match("x", 0);
  await match.open();
  await match.grow(progress(0.2, 0));
  expect([match.timeline.value, match.run.value?.indexed]).toEqual([null, 0.1]);
  answers = { "runs/x": run(0.4), "/timeline": timeline(3) };
  await match.grow(progress(0.4, 3));
  expect(match.timeline.value?.steps).toEqual([0, 1, 2]);
  match.close();
});
