import { describe, expect, test } from "vitest";
import { moved, placeAt, viewOf, whole, zoomedAt, type Box } from "../src/map/camera";
import { nextUnit } from "../src/map/pick";
import { turn, type Spot } from "../src/map/spots";
import { letters } from "../src/map/units";
import { Flag } from "../src/wire";

const bounds: Box = [0, 8, 64, 40];

describe("a camera", () => {
  test("without a zoom shows all of the bounds in the middle", () => {
    const view = viewOf(null, bounds, 640, 640);
    expect(placeAt(view, 0, 320)).toEqual([0, 24]);
    expect(placeAt(view, 640, 320)).toEqual([64, 24]);
  });

  test("keeps the place under the pointer where it is while it zooms", () => {
    const view = viewOf(null, bounds, 640, 640);
    const near = zoomedAt(whole(bounds), view, bounds, 4, 200, 300);
    const [x, y] = placeAt(viewOf(near, bounds, 640, 640), 200, 300);
    expect(x).toBeCloseTo(placeAt(view, 200, 300)[0]);
    expect(y).toBeCloseTo(placeAt(view, 200, 300)[1]);
  });

  test("does not leave the map", () => {
    const near = { x: 32, y: 24, zoom: 4 };
    expect(moved(near, viewOf(near, bounds, 640, 640), bounds, 1e6, 0)).toEqual({ x: 0, y: 24, zoom: 4 });
  });
});

test("a unit turns the shorter way around", () => {
  expect(turn(0.1, 2 * Math.PI - 0.1)).toBeCloseTo(-0.2);
  expect(turn(-3, 3)).toBeCloseTo(6 - 2 * Math.PI);
});

test.each([["Stalker", "St"], ["SiegeTank", "ST"], ["SCV", "SC"]])("%s is written %s", (type, two) => expect(letters(type)).toBe(two));

test("the next unit is a fighter first, and after the last one comes the first again", () => {
  const spot = (tag: number, flags: number, tint: 0 | 1 | 2 = 0) => ({ tint, unit: { tag, flags } }) as Spot;
  const spots = [spot(1, Flag.WORKER), spot(2, Flag.STRUCTURE), spot(3, Flag.ARMY, 1), spot(4, Flag.ARMY), spot(5, 0, 2)];
  const chain = [1, 2, 3, 4, 5].reduce<number[]>((tags) => [...tags, ...nextUnit(spots, tags.at(-1), 1)], []);
  expect(chain).toEqual([4, 3, 2, 1, 4]);
  expect(nextUnit(spots, 4, -1)).toEqual([1]);
  expect(nextUnit([], 4, 1)).toEqual([]);
});
