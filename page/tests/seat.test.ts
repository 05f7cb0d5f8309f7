import { expect, test } from "vitest";
import { addCall, addMessage, callOf } from "../src/seat/draft";
import { candidates, fromScreen, pointAt, question, wanted, type Picking } from "../src/seat/picking";
import type { ActionSpec, TeamView, UnitView, View } from "../src/wire";

const attack: ActionSpec = { name: "Attack_Unit", args: ["tag"], description: "", actors: 0, target: "enemy" };
const alone: ActionSpec = { ...attack, name: "Select_Unit_Move_Screen", args: ["tag", "screen"], actors: 1, target: null };
const far: ActionSpec = { ...attack, name: "Move_Minimap", args: ["minimap"], target: null };

const unit = (tag: string, alliance: UnitView["alliance"], distance: number | null = null) =>
  ({ tag, type: "Zealot", alliance, distance, minimap: [1, 2], health: 99.6, shield: 50, shield_max: 50 }) as unknown as UnitView;
const team = {
  name: "Zealot-1", minimap: [30, 20], units: [unit("0x1", "own"), unit("0x2", "own")], allies: [unit("0x3", "ally")],
  enemies: [unit("0x8", "enemy", 9), unit("0x9", "enemy", 3)], arguments: [], resources: [], bounds: [0.5, 0, 24, 24],
} as unknown as TeamView;
const view = { cell: 0.5, bounds: [0, 0, 64, 64], teams: [team], landmarks: [], alerts: [], places: [{ name: "Base 2", minimap: [5, 6] }] } as unknown as View;
const picking = (action: ActionSpec, ...args: Picking["args"]): Picking => ({ team: "Zealot-1", action, args });

test("calls are written as agents write them", () => {
  expect(callOf(attack, ["0x9"])).toBe("<Attack_Unit(0x9)>");
  expect(callOf(alone, ["0x1", [20.5, 9]])).toBe("<Select_Unit_Move_Screen(0x1, [20.5, 9])>");
  expect(callOf({ name: "Hold_Position" }, [])).toBe("<Hold_Position()>");
});

test("each call goes below its team, and messages come last", () => {
  let text = addMessage("", "Stalkers", "take '''the''' left one");
  text = addCall(text, "A", "<One()>");
  text = addCall(text, "B", "<Two()>");
  text = addCall(text, "A", "<Three()>");
  expect(text).toBe(
    "Actions:\n    Team A:\n        <One()>\n        <Three()>\n    Team B:\n        <Two()>\n" +
      "Communications:\n    <MessageTo(Stalkers, '''take \"the\" left one''')>\n",
  );
});

test("what a person has typed stays", () => {
  const typed = "Analysis: they come\n\nActions:\nTeam A:\n<Stop()>\n\n\n";
  expect(addCall(typed, "A", "<Go()>")).toBe("Analysis: they come\n\nActions:\nTeam A:\n<Stop()>\n        <Go()>\n");
  expect(addCall("just words", "A", "<Go()>")).toBe("just words\nActions:\n    Team A:\n        <Go()>\n");
});

test("a list offers what will do, the nearest enemy first", () => {
  const tags = (of: Picking) => candidates(of, view).map((one) => one.argument);
  expect(tags(picking(attack))).toEqual(["0x9", "0x8"]);
  expect(tags(picking(alone))).toEqual(["0x1", "0x2"]);
  expect(tags(picking(far))).toEqual([[5, 6]]);
  const only = { ...view, teams: [{ ...team, arguments: [{ action: "Attack_Unit", units: [], tags: ["0x8"], points: [] }] }] };
  expect(candidates(picking(attack), only).map((one) => one.argument)).toEqual(["0x8"]);
  expect(candidates(picking(attack), view)[0].name).toBe("Zealot, 100 + 50");
});

test("arguments are asked for one after the other", () => {
  expect([wanted(picking(alone)), wanted(picking(alone, "0x1")), wanted(picking(alone, "0x1", [1, 2]))]).toEqual(["tag", "screen", null]);
  expect([question(picking(alone)), question(picking(alone, "0x1")), question(picking(attack))]).toEqual(["which of your units", "which place on the screen", "which enemy"]);
});

test("a place of the map becomes a point of the frame that is wanted", () => {
  const screen = picking(alone, "0x1");
  expect(pointAt([30, 20], screen, view)).toEqual([12, 12]);
  expect(pointAt(fromScreen([20.3, 4], team, 0.5)!, screen, view)).toEqual([20.3, 4]);
  expect(pointAt([-20, 99], screen, view)).toEqual([0.5, 23.9]);
  expect(pointAt([63.99, 0], picking(far), view)).toEqual([63.9, 0]);
  expect(pointAt([1, 1], picking(attack), view)).toBeNull();
});
