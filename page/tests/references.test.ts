import { expect, test } from "vitest";
import { references } from "../src/references";

const screens = [
  { name: "Stalker-1", minimap: [20, 30] as [number, number], screen: 12 },
  { name: "Zealot-1", minimap: [40, 10] as [number, number], screen: 24 },
];
const found = (text: string) => references(text, screens).filter((p) => p.tag !== undefined || p.at);

test("the pieces of a text are the text", () => {
  const text = "Team A:\n <Attack(0x100240000)> at minimap [1, 2], screen [3,4] (5, 6) 0xg <b>&amp;</b>\n";
  expect(references(text, screens).map((p) => p.text).join("")).toBe(text);
});

test("a tag is the unit's number", () => expect(found("fire on 0x100240000.")).toEqual([{ text: "0x100240000", tag: 0x100240000 }]));

test("a point is in the frame that its line says last", () => {
  expect(found("Minimap position: [21.2, 30.9]")).toEqual([{ text: "[21.2, 30.9]", at: [21.2, 30.9] }]);
  expect(found("<Move_Minimap((3, 4))>")).toEqual([{ text: "(3, 4)", at: [3, 4] }]);
});

test("a point of a screen is where the screen of the team above it is", () => {
  expect(found("Team Stalker-1:\n  <Move_Screen([12, 12])>\nTeam Zealot-1:\n  <Move_Screen([0, 24])>").map((p) => p.at)).toEqual([
    [20, 30],
    [28, 22],
  ]);
});

test("a point that no screen has is one of the minimap, and so is any point of a message", () => {
  expect(found("attack at [35.4, 3.8]").map((p) => p.at)).toEqual([[35.4, 3.8]]);
  expect(references("gather at [5, 3.8]", [], "minimap").map((p) => p.at)).toEqual([undefined, [5, 3.8]]);
});

test("a pair of numbers without a frame, or of a team that is unknown, is no place", () => {
  expect(found("odds of (3, 4)")).toEqual([]);
  expect(found("Team Ghost-1:\n <Move_Screen([12, 12])>")).toEqual([]);
});
