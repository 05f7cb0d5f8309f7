/** The whole map in a corner, while a part of it is shown: a click goes there. */

import { useEffect, useRef } from "preact/hooks";
import { effect } from "@preact/signals";
import type { Match } from "../match";
import { palette } from "../theme";
import { camera, placeAt, viewOf, whole } from "./camera";
import { groundOf, sizeOf } from "./ground";
import type { Painter } from "./painter";
import { is } from "../scenes";

const SIZE = 128;

export function Minimap({ match, painter }: { match: Match; painter: Painter }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  useEffect(() => keepSmall(canvas.current!, match, painter), [painter]);
  const go = (event: PointerEvent) => {
    if (event.buttons !== 1) return;
    const view = viewOf(null, painter.bounds(), SIZE, SIZE);
    const [x, y] = placeAt(view, event.offsetX, event.offsetY);
    camera.value = { ...(camera.value ?? whole(painter.bounds())), x, y };
  };
  return <canvas ref={canvas} class="minimap" width={SIZE * 2} height={SIZE * 2} aria-hidden="true" onPointerDown={go} onPointerMove={go} />;
}

function keepSmall(canvas: HTMLCanvasElement, match: Match, painter: Painter): () => void {
  let ground: HTMLCanvasElement | null = null;
  const context = canvas.getContext("2d")!;
  const draw = () => {
    const colours = palette.value;
    const view = viewOf(null, painter.bounds(), SIZE, SIZE);
    context.setTransform(2, 0, 0, 2, 0, 0);
    context.fillStyle = colours.ground;
    context.fillRect(0, 0, SIZE, SIZE);
    const terrain = match.terrain.value;
    if (terrain && ground) {
      const [width, height] = sizeOf(terrain);
      context.drawImage(ground, view.left, view.top, width * view.scale, height * view.scale);
    }
    for (const { unit, tint, x, y } of painter.spots) {
      const r = is(unit, "STRUCTURE") ? 2 : 1.3;
      context.fillStyle = colours.sides[tint];
      context.fillRect(x * view.scale + view.left - r, y * view.scale + view.top - r, 2 * r, 2 * r);
    }
    const main = painter.view;
    const [x0, y0] = placeAt(main, 0, 0);
    context.strokeStyle = colours.text;
    context.lineWidth = 1;
    context.strokeRect(x0 * view.scale + view.left, y0 * view.scale + view.top, (main.width / main.scale) * view.scale, (main.height / main.scale) * view.scale);
  };
  let request = 0;
  const stop = effect(() => {
    void [match.place.value, camera.value, match.scenes.arrived.value, palette.value];
    request ||= requestAnimationFrame(() => {
      request = 0;
      draw();
    });
  });
  const terrain = match.terrain.peek();
  if (terrain) void groundOf(terrain, palette.peek()).then((made) => ((ground = made), draw()));
  return () => {
    cancelAnimationFrame(request);
    stop();
  };
}
