/** The map of a match, on a canvas, with what is pointed at and chosen written beside it. */

import { effect, signal, useSignal } from "@preact/signals";
import { useEffect, useMemo, useRef } from "preact/hooks";
import type { Match } from "../match";
import { is } from "../scenes";
import { agent, chosen, eyes, hovered, matches, off, spoken } from "../stage";
import { palette } from "../theme";
import { around, camera, type View } from "./camera";
import { Minimap } from "./Minimap";
import { Painter } from "./painter";
import { nextUnit, unitAt, unitsIn, type Pointed } from "./pick";
import { listen, zoom, type Target } from "./pointer";
import { Chosen, Tip } from "./Selection";
import { Tools } from "./Tools";

export function MapView({ match, name = "" }: { match: Match; name?: string }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const pointed = useSignal<Pointed | null>(null);
  const frame = useSignal<readonly [number, number, number, number] | null>(null);
  const drawn = useSignal(true);
  const stale = useMemo(() => signal(0), []);
  const painter = useMemo(() => new Painter(match, () => void stale.value++), [match]);
  const target = useMemo(() => targetOf(painter, pointed, frame), [painter]);
  useEffect(() => listen(canvas.current!, target), [target]);
  useEffect(() => keepDrawn(canvas.current!, painter, match, stale, drawn), [painter]);
  const middle = (factor: number) => zoom(target, factor, painter.view.width / 2, painter.view.height / 2);
  return (
    <section class="map" aria-label={`Map ${name}`.trim()}>
      <canvas ref={canvas} class="map-canvas" tabIndex={0} role="img" aria-label={describe(match)} />
      {frame.value && <div class="map-box" style={boxStyle(frame.value)} />}
      {!drawn.value && <p class="map-empty">{match.timeline.value?.steps.length ? "No scene of this moment is here yet." : "Nothing has been played yet."}</p>}
      <Tools match={match} zoom={middle} fit={() => fit(painter)} />
      {camera.value && <Minimap match={match} painter={painter} />}
      {pointed.value && <Tip match={match} pointed={pointed.value} width={painter.view.width} />}
      <Chosen match={match} painter={painter} />
    </section>
  );
}

const sameMap = () => new Set(matches.peek().map((m) => m.run.peek()?.line.map)).size === 1;

/** Show the units that are chosen, or all of both sides. */
function fit(painter: Painter): void {
  const units = painter.spots.filter((spot) => (chosen.value.size ? chosen.value.has(spot.unit.tag) : spot.tint !== 2));
  camera.value = around(units, painter.bounds(), painter.view.width, painter.view.height);
}

const describe = (match: Match) =>
  `Map of ${match.run.value?.line.map ?? "the match"}. Keys: W A S D move, plus and minus zoom, 0 shows all of it, U goes from unit to unit.`;

const boxStyle = ([x0, y0, x1, y1]: readonly [number, number, number, number]) => ({
  left: `${Math.min(x0, x1)}px`,
  top: `${Math.min(y0, y1)}px`,
  width: `${Math.abs(x1 - x0)}px`,
  height: `${Math.abs(y1 - y0)}px`,
});

function targetOf(painter: Painter, pointed: { value: Pointed | null }, frame: { value: readonly [number, number, number, number] | null }): Target {
  const hover = (x: number, y: number) => {
    const spot = unitAt(painter.spots, painter.view, x, y);
    pointed.value = spot ? { spot, x, y } : null;
    hovered.value = spot?.unit.tag ?? 0;
  };
  return {
    bounds: () => painter.bounds(),
    view: (): View => painter.view,
    hover,
    leave: () => {
      pointed.value = null;
      hovered.value = 0;
    },
    pick: (x, y, add) => {
      const spot = unitAt(painter.spots, painter.view, x, y);
      chosen.value = new Set([...(add ? chosen.value : []), ...(spot ? [spot.unit.tag] : [])]);
      hover(x, y);
    },
    next: (by) => (chosen.value = new Set(nextUnit(painter.spots, [...chosen.value][0], by))),
    box: (from, to, done) => {
      frame.value = done ? null : [...from, ...to];
      if (done) chosen.value = unitsIn(painter.spots, painter.view, from, to);
    },
  };
}

/** Draw again whenever something that the map shows has changed, once a frame at most. */
function keepDrawn(canvas: HTMLCanvasElement, painter: Painter, match: Match, stale: { value: number }, drawn: { value: boolean }): () => void {
  let request = 0;
  let fitted = false;
  const resized = new ResizeObserver(() => void stale.value++);
  resized.observe(canvas);
  const draw = () => {
    request = 0;
    const { width, height } = canvas.getBoundingClientRect();
    if (!width || !height) return;
    const dots = Math.min(devicePixelRatio, 2);
    if (canvas.width !== Math.round(width * dots) || canvas.height !== Math.round(height * dots)) {
      canvas.width = Math.round(width * dots);
      canvas.height = Math.round(height * dots);
    }
    const context = canvas.getContext("2d")!;
    context.setTransform(dots, 0, 0, dots, 0, 0);
    drawn.value = painter.paint(context, width, height, wish());
    if (drawn.value) canvas.dataset.step = String(painter.step); // what is drawn, for tests and measurements
    if (drawn.value && !fitted && width > 0) {
      fitted = true;
      // a battle takes place in a small part of its map
      if (!camera.value && sameMap() && !painter.spots.some(({ unit }) => is(unit, "STRUCTURE"))) fit(painter);
    }
  };
  const stop = effect(() => {
    wish();
    void [match.place.value, match.terrain.value, match.scenes.arrived.value, match.decisions.value, stale.value];
    request ||= requestAnimationFrame(draw);
  });
  return () => {
    cancelAnimationFrame(request);
    resized.disconnect();
    stop();
  };
}

const wish = () => ({
  camera: camera.value,
  eyes: eyes.value,
  off: off.value,
  agent: agent.value,
  colours: palette.value,
  lit: spoken.value?.tags ?? [],
  places: spoken.value?.at ?? [],
  chosen: chosen.value,
  hovered: hovered.value,
});
