/** Scenes of an episode: asked for in pages around the moment that is shown, unpacked once, forgotten when far away. */

import { signal } from "@preact/signals";
import { get, inflate } from "./api";
import { Recent } from "./cache";
import { Flag, SCENES_AT_ONCE, type GridView, type Scene, type Scenes, type UnitMark } from "./wire";

/** A unit of a scene; see `UnitMark`. */
export interface Unit {
  tag: number;
  type: string;
  player: number;
  x: number;
  y: number;
  radius: number;
  facing: number;
  health: number;
  healthMax: number;
  shield: number;
  shieldMax: number;
  energy: number;
  progress: number;
  flags: number;
  seenBy: number;
  order: string;
  target: number;
  toX: number;
  toY: number;
}

/** A scene with its units by tag. */
export interface Frame extends Omit<Scene, "units"> {
  units: Unit[];
  byTag: Map<number, Unit>;
}

/** Whether a unit has a property of `Flag`. */
export const is = (unit: Unit, flag: keyof typeof Flag) => (unit.flags & Flag[flag]) !== 0;

/** Pages that are kept: 24 of 16 scenes with 400 units take about 40 MB. */
const PAGES = 24;
/** Requests under way: a second one hides the way to the server, more delay the page that is looked at. */
const AT_ONCE = 2;

export class SceneStore {
  /** Counts arrivals, so that what was drawn without a scene is drawn again. */
  readonly arrived = signal(0);
  private readonly pages = new Recent<Frame[]>(PAGES);
  /** Pages that were asked for when nothing more was to come: short ones stay short. */
  private readonly final = new Set<number>();
  private readonly under_way = new Set<number>();
  private wanted: number[] = [];

  /** `path` is that of the episode; a page that was short while it `grows` is asked for again. */
  constructor(private readonly path: string, private readonly grows: () => boolean) {}

  /** Return the scene of a step, or the last one of its page before it; null if there is none, undefined if not yet. */
  frame(step: number): Frame | null | undefined {
    const page = this.pages.get(String(Math.floor(step / SCENES_AT_ONCE)));
    return page && (page.findLast((frame) => frame.step <= step) ?? page[0] ?? null);
  }

  /** Ask for the scenes of a step, and then for those around it, first in the direction of play. */
  want(step: number, last: number, forward = true): void {
    const page = Math.floor(step / SCENES_AT_ONCE);
    const lastPage = Math.floor(last / SCENES_AT_ONCE);
    const around = forward ? [page, page + 1, page - 1, page + 2] : [page, page - 1, page + 1, page - 2];
    this.wanted = around.filter((p) => p >= 0 && p <= lastPage && this.lacks(p, last));
    this.ask();
  }

  private lacks(page: number, last: number): boolean {
    const held = this.pages.get(String(page));
    if (!held) return true;
    const end = Math.min(last, (page + 1) * SCENES_AT_ONCE - 1);
    return !this.final.has(page) && (held[held.length - 1]?.step ?? -1) < end;
  }

  private ask(): void {
    while (this.under_way.size < AT_ONCE) {
      const page = this.wanted.find((p) => !this.under_way.has(p));
      if (page === undefined) return;
      this.wanted = this.wanted.filter((p) => p !== page);
      void this.load(page);
    }
  }

  private async load(page: number): Promise<void> {
    this.under_way.add(page);
    const from = page * SCENES_AT_ONCE;
    const final = !this.grows();
    try {
      const answer = await get<Scenes>(`${this.path}/scenes?from=${from}&to=${from + SCENES_AT_ONCE - 1}`);
      this.pages.set(String(page), answer.scenes.map(frameOf));
      if (final) this.final.add(page);
    } catch {
      this.pages.set(String(page), []); // the map then says that there is no scene
    }
    this.under_way.delete(page);
    this.arrived.value++;
    this.ask();
  }
}

function frameOf(scene: Scene): Frame {
  const units = scene.units.map(unitOf);
  return { ...scene, units, byTag: new Map(units.map((unit) => [unit.tag, unit])) };
}

function unitOf(mark: UnitMark): Unit {
  const [tag, type, player, x, y, radius, facing, health, healthMax, shield, shieldMax, energy, progress, flags, seenBy, order, target, toX, toY] = mark;
  return { tag, type, player, x, y, radius, facing, health, healthMax, shield, shieldMax, energy, progress, flags, seenBy, order, target, toX, toY };
}

/** A grid unpacked: a byte for each cell. */
export interface Grid {
  width: number;
  height: number;
  cells: Uint8Array;
}

const unpacked = new WeakMap<GridView, Promise<Grid>>();

/** Return the cells of a grid; the second time at once. */
export function grid(view: GridView): Promise<Grid> {
  let cells = unpacked.get(view);
  if (!cells) {
    cells = inflate(view.data, "deflate").then((bytes) => ({ width: view.width, height: view.height, cells: bytes }));
    unpacked.set(view, cells);
  }
  return cells;
}
