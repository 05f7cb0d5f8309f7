/** Buttons over the map: whose eyes, which layers, how near. */

import type { Match } from "../match";
import { LAYERS, eyes, menu, off, toggleLayer, toggleMenu, type Layer } from "../stage";
import { capital } from "../words";
import { camera } from "./camera";

const MEANING: Record<Layer, string> = {
  terrain: "ground, its height and walls",
  creep: "where creep is",
  fog: "what the chosen eyes do not see",
  resources: "minerals and geysers",
  power: "fields of Pylons",
  effects: "storms, biles, clouds",
  orders: "lines to where orders lead",
  shots: "weapons that have just fired",
  paths: "ways of the last seconds",
  deaths: "crosses where units died",
  screens: "what the chosen agent's teams look at",
  deeds: "what the chosen agent asked for",
  names: "types of units",
};

export function Tools({ match, zoom, fit }: { match: Match; zoom: (factor: number) => void; fit: () => void }) {
  return (
    <div class="map-tools">
      <label>
        <span class="hidden">Eyes</span>
        <select value={eyes.value} onChange={(e) => (eyes.value = e.currentTarget.value)} title="Whose eyes the map has">
          <option value="">Observer</option>
          {(match.run.value?.sides ?? []).map((side) => (
            <option value={side}>{capital(side)}</option>
          ))}
          {match.agents.value.map((a) => (
            <option value={`${a.side}/${a.name}`}>{`${a.name} (${a.side})`}</option>
          ))}
        </select>
      </label>
      <button class="menu" aria-expanded={menu.value === "layers"} onClick={() => toggleMenu("layers")} title="Layers (m)">
        Layers
      </button>
      <span class="joined">
        <button onClick={() => zoom(1 / 1.5)} aria-label="Zoom out" title="Zoom out (-)">
          −
        </button>
        <button onClick={() => zoom(1.5)} aria-label="Zoom in" title="Zoom in (+)">
          +
        </button>
        <button onClick={fit} title="Show the chosen units, or all of both sides">
          Fit
        </button>
        {camera.value && <button onClick={() => (camera.value = null)}>Whole map</button>}
      </span>
      {menu.value === "layers" && (
        <fieldset class="layers">
          <legend class="hidden">Layers</legend>
          {LAYERS.map((layer) => (
            <label key={layer} title={MEANING[layer]}>
              <input type="checkbox" checked={!off.value.has(layer)} onChange={() => toggleLayer(layer)} /> {layer}
              <span class="muted"> {MEANING[layer]}</span>
            </label>
          ))}
        </fieldset>
      )}
    </div>
  );
}
