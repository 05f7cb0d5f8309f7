import { expect, test } from "vitest";
import { Recent, newest } from "../src/cache";

test("what was used longest ago is forgotten first", () => {
  const recent = new Recent<number>(2);
  recent.set("a", 1);
  recent.set("b", 2);
  recent.get("a");
  recent.set("c", 3);
  expect(["a", "b", "c"].map((key) => recent.get(key))).toEqual([1, undefined, 3]);
});

test("of what is asked for meanwhile only the newest is loaded", async () => {
  const asked: string[] = [];
  const answers: (() => void)[] = [];
  const done: string[] = [];
  const load = newest(
    (key) => {
      asked.push(key);
      return new Promise<string>((answer) => answers.push(() => answer(key)));
    },
    (value) => void done.push(value),
    () => undefined,
  );
  for (const key of ["1", "2", "3"]) load(key);
  answers[0]();
  await Promise.resolve().then(() => undefined);
  await Promise.resolve();
  answers[1]();
  await Promise.resolve();
  await Promise.resolve();
  expect([asked, done]).toEqual([["1", "3"], ["1", "3"]]);
});
