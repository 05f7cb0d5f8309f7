/** Buttons of the clock, and which curves are shown. */

import * as clock from "../clock";
import { CHARTS, charts, toggleChart } from "../curves/series";
import type { Match } from "../match";
import { stepBy } from "../keys";
import { menu, toggleMenu } from "../stage";
import { clockText } from "../time";

export function Controls({ matches }: { matches: readonly Match[] }) {
  const [match] = matches;
  const live = matches.some((m) => m.isLive());
  return (
    <div class="controls">
      <span class="joined">
        <button onClick={() => stepBy(-1)} aria-label="Step back" title="Step back (←)">
          ◂
        </button>
        <button class="play" onClick={() => clock.play(!clock.playing.value)} aria-label={clock.playing.value ? "Pause" : "Play"} title="Play or pause (space)">
          {clock.playing.value ? "❚❚" : "▶"}
        </button>
        <button onClick={() => stepBy(1)} aria-label="Step on" title="Step on (→)">
          ▸
        </button>
      </span>
      <label>
        <span class="hidden">Speed</span>
        <select value={clock.speed.value} onChange={(e) => (clock.speed.value = Number(e.currentTarget.value))} title="Speed ([ and ])">
          {clock.SPEEDS.map((s) => (
            <option value={s}>×{s}</option>
          ))}
        </select>
      </label>
      {live && (
        <button aria-pressed={clock.following.value} onClick={() => clock.follow(!clock.following.value)} title="Follow live (f)">
          <span class="live-dot" /> Follow
        </button>
      )}
      <output class="clock" title="Game time">
        {clockText(match.timeline.value?.time_s[match.index.value] ?? 0)}
        <small> / {clockText(match.timeline.value?.time_s.at(-1) ?? 0)}</small>
      </output>
      <span class="muted steps">
        step {match.step.value} of {match.timeline.value?.steps.at(-1) ?? 0}
      </span>
      <span class="spring" />
      {clock.zoomed.value && <button onClick={() => (clock.zoomed.value = null)}>Whole time line</button>}
      <label class="choice">
        Axis{" "}
        <select value={clock.axis.value} onChange={(e) => changeAxis(match, e.currentTarget.value as "time" | "step")}>
          <option value="time">game time</option>
          <option value="step">steps</option>
        </select>
      </label>
      <span class="anchor">
        <button class="menu" aria-expanded={menu.value === "curves"} onClick={() => toggleMenu("curves")}>
          Curves
        </button>
        {menu.value === "curves" && (
          <fieldset class="layers above">
            <legend class="hidden">Curves</legend>
            {CHARTS.map((chart) => (
              <label key={chart.id}>
                <input type="checkbox" checked={charts.value.includes(chart.id)} onChange={() => toggleChart(chart.id)} /> {chart.name}
              </label>
            ))}
          </fieldset>
        )}
      </span>
    </div>
  );
}

/** Change what the clock counts, and stay at the same step. */
function changeAxis(match: Match, axis: "time" | "step"): void {
  const { timeline, index } = { timeline: match.timeline.value, index: match.index.value };
  clock.zoomed.value = null;
  clock.axis.value = axis;
  if (timeline) clock.go((axis === "time" ? timeline.time_s : timeline.steps)[index] ?? 0);
}
