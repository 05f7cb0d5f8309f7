/** Curves above the time line, by uPlot; the line of the moment goes through them. */

import { effect } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import * as clock from "../clock";
import type { Match } from "../match";
import { palette } from "../theme";
import { GUTTER, MARGIN } from "../timeline/measure";
import { capital } from "../words";
import { CHARTS, charts, linesOf, type Chart, type Line } from "./series";

const HEIGHT = 82;

export function Curves({ matches }: { matches: readonly Match[] }) {
  return (
    <div class="curves">
      {CHARTS.filter((chart) => charts.value.includes(chart.id)).map((chart) => (
        <CurveView key={chart.id} chart={chart} matches={matches} />
      ))}
    </div>
  );
}

function CurveView({ chart, matches }: { chart: Chart; matches: readonly Match[] }) {
  const box = useRef<HTMLDivElement>(null);
  useEffect(() => keepDrawn(box.current!, chart, matches), [chart, matches]);
  return (
    <div class="curve" role="img" aria-label={`${chart.name}: ${values(chart, matches).map(([name, value]) => `${name} ${value}`).join(", ")}`}>
      <p class="curve-name">
        {chart.name}
        {values(chart, matches).map(([name, value, tint], i) => (
          <b key={i} class={`side-${tint}`}>
            {matches.length > 1 && <i>{name.split(" ")[0]}</i>} {value}
          </b>
        ))}
      </p>
      <div ref={box} style={{ height: `${HEIGHT}px` }} />
    </div>
  );
}

/** Return the values at the moment, each with the name and the tint of its side. */
function values(chart: Chart, matches: readonly Match[]): [string, string, number][] {
  return matches.flatMap((match, m) =>
    [...match.sides.value, ""].flatMap((side, i): [string, string, number][] => {
      const all = chart.values(match, side);
      if (!all || all.every((v) => v === null)) return [];
      const name = `${matches.length > 1 ? `${"AB"[m]} ` : ""}${capital(side)}`;
      return [[name, chart.write(all[match.index.value] ?? null), side === "" ? 2 : Math.min(i, 1)]];
    }),
  );
}

function keepDrawn(box: HTMLElement, chart: Chart, matches: readonly Match[]): () => void {
  let plot: uPlot | undefined;
  const width = () => Math.max(box.clientWidth, GUTTER + 50);
  const stopPlot = effect(() => {
    const lines = linesOf(chart, matches, clock.axis.value);
    plot?.destroy();
    plot = lines.length ? new uPlot(options(chart, lines, width()), joined(lines), box) : undefined;
    const [min, max] = clock.shown.peek();
    plot?.setScale("x", { min, max });
  });
  const stopScale = effect(() => {
    const [min, max] = clock.shown.value;
    plot?.setScale("x", { min, max });
  });
  const resized = new ResizeObserver(() => plot?.setSize({ width: width(), height: HEIGHT }));
  resized.observe(box);
  return () => {
    stopPlot();
    stopScale();
    resized.disconnect();
    plot?.destroy();
  };
}

function joined(lines: readonly Line[]): uPlot.AlignedData {
  const tables = lines.map((line) => [line.x, line.y] as unknown as uPlot.AlignedData);
  return tables.length > 1 ? uPlot.join(tables, tables.map(() => [0, 2])) : tables[0];
}

function options(chart: Chart, lines: readonly Line[], width: number): uPlot.Options {
  const colours = palette.value;
  return {
    width,
    height: HEIGHT,
    padding: [16, MARGIN, 4, 0],
    legend: { show: false },
    cursor: { show: false },
    scales: { x: { time: false, auto: false }, y: { range: (_, low, high) => [Math.min(0, low ?? 0), high ? high * 1.08 : 1] } },
    axes: [
      { show: false },
      {
        size: GUTTER,
        stroke: colours.muted,
        font: "11px system-ui, sans-serif",
        gap: 6,
        space: 26,
        grid: { stroke: colours.line, width: 1 },
        ticks: { show: false },
        values: (_, ticks) => ticks.map(chart.write),
      },
    ],
    series: [{}, ...lines.map((line) => series(line, colours.sides[line.tint]))],
  };
}

const series = (line: Line, stroke: string): uPlot.Series => ({
  stroke,
  width: 1.75,
  dash: line.match ? [5, 4] : undefined,
  fill: line.match ? undefined : `${stroke}14`,
  spanGaps: true,
  points: { show: false },
});
