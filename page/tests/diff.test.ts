import { expect, test } from "vitest";
import { diffLines } from "../src/diff";

const marked = (a: string, b: string) => diffLines(a, b).map((l) => `${{ same: " ", added: "+", removed: "-" }[l.change]}${l.text}`);

test("lines that both have stay, others come and go in place", () => {
  expect(marked("a\nb\nc\nd", "a\nc\nx\nd")).toEqual([" a", "-b", " c", "+x", " d"]);
});

test("the same text has no change, another one nothing else", () => {
  expect(marked("a\nb", "a\nb")).toEqual([" a", " b"]);
  expect(marked("a", "b")).toEqual(["-a", "+b"]);
});

test("a diff gives both texts back", () => {
  const [a, b] = ["1\n2\n3\n4\n5\n6", "0\n2\n4\n4\n6\n7"];
  const lines = diffLines(a, b);
  expect(lines.filter((l) => l.change !== "added").map((l) => l.text).join("\n")).toBe(a);
  expect(lines.filter((l) => l.change !== "removed").map((l) => l.text).join("\n")).toBe(b);
});
