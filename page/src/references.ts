/** Units and places that a text speaks of: tags as `0x…`, points as `[x, y]` in one of two frames. */

/** A piece of a text: plain words, or a reference to a unit or to a place of the minimap frame. */
export interface Piece {
  text: string;
  tag?: number;
  at?: [number, number];
}

/** Where the screens of an agent's teams are, in the minimap frame; see `TeamMark`. */
export interface Screen {
  name: string;
  minimap: [number, number] | null;
  screen: number;
}

const REFERENCE = /0x[0-9a-fA-F]{3,16}\b|[[(]\s*(-?\d+(?:\.\d+)?)\s*,\s*(-?\d+(?:\.\d+)?)\s*[\])]/g;
const HEADING = /^[ \t]*Team ([^\s:]+)/gm;
const SCREEN_CELLS = 24;
const MINIMAP_CELLS = 64;

/**
 * Split a text into pieces, in order, that together are the text. A point without a word for its frame is left alone if
 * it may be of either one, unless `frame` says that it is of the minimap, as agents mean it in messages.
 */
export function references(text: string, screens: readonly Screen[] = [], frame?: "minimap"): Piece[] {
  const headings = [...text.matchAll(HEADING)].map((m) => ({ at: m.index, name: m[1] }));
  const pieces: Piece[] = [];
  let end = 0;
  let heading = -1;
  for (const match of text.matchAll(REFERENCE)) {
    while (heading + 1 < headings.length && headings[heading + 1].at < match.index) heading++;
    const found = match[1] === undefined ? { tag: Number(match[0]) } : place(text, match, screens, headings[heading]?.name, frame);
    if (!found) continue;
    if (match.index > end) pieces.push({ text: text.slice(end, match.index) });
    pieces.push({ text: match[0], ...found });
    end = match.index + match[0].length;
  }
  if (end < text.length) pieces.push({ text: text.slice(end) });
  return pieces;
}

/** Return the place that a point means: the nearest word before it on its line says in which frame it is. */
function place(text: string, match: RegExpMatchArray, screens: readonly Screen[], team?: string, usual?: "minimap"): Pick<Piece, "at"> | null {
  const index = match.index ?? 0;
  const point: [number, number] = [Number(match[1]), Number(match[2])];
  const line = text.slice(text.lastIndexOf("\n", index) + 1, index).toLowerCase();
  const frame = line.lastIndexOf("minimap") > line.lastIndexOf("screen") ? "minimap" : line.includes("screen") ? "screen" : isOffScreen(point) ? "minimap" : usual;
  if (frame === "minimap") return { at: point };
  const screen = screens.find((s) => s.name === team && s.minimap) ?? (screens.length === 1 ? screens[0] : undefined);
  return frame === "screen" && screen?.minimap ? { at: fromScreen(point, screen.minimap, screen.screen) } : null;
}

/** Whether a point can only be one of the minimap, which is larger than a screen. */
const isOffScreen = ([x, y]: [number, number]) => Math.max(x, y) >= SCREEN_CELLS && Math.max(x, y) < MINIMAP_CELLS && Math.min(x, y) >= 0;

function fromScreen(point: [number, number], centre: [number, number], size: number): [number, number] {
  const cell = size / SCREEN_CELLS;
  return [centre[0] + (point[0] - SCREEN_CELLS / 2) * cell, centre[1] + (point[1] - SCREEN_CELLS / 2) * cell];
}
