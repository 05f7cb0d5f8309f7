import { expect, test } from "vitest";
import { story, type Standing } from "../src/standing";

const side = (name: string, army: number | null, killed: number | null = null, lost: number | null = null): Standing => ({ side: name, army, workers: 12, killed, lost });

test.each([
  [side("blue", 1200, 950, 400), side("opponent", 500), "Blue is ahead: 2.4 times the army of Opponent. Blue destroyed 950 and lost 400."],
  [side("blue", 500), side("red", 0), "Blue is ahead: Red has no army in sight."],
  [side("blue", 500), side("red", 520), "Even: armies of 500 and 520."],
  [side("blue", 0), side("red", 0), "No side has an army; both have 12 workers."],
  [side("blue", null), side("red", 100), "Nothing is known of the armies yet."],
])("who is ahead is said in a sentence", (a, b, words) => expect(story(a, b)).toBe(words));
