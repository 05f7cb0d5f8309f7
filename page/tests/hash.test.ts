import { expect, test } from "vitest";
import { NOWHERE, readHash, writeHash } from "../src/hash";

test("a link is read as it was written", () => {
  const link = { ...NOWHERE, a: "f2f5", b: "77", e: 1, s: 0, agent: "blue/Zealots 1", eyes: "blue/Zealots 1", off: ["fog", "paths"], by: "step" as const };
  expect(readHash(writeHash(link))).toEqual(link);
});

test("what is as usual is not written", () => expect(writeHash({ a: "f2f5", s: 25 })).toBe("#a=f2f5&s=25"));

test("an address that nobody wrote is the library", () => expect(readHash("#%&s=-3&e=x")).toEqual({ ...NOWHERE, s: 0 }));
