/** The keys of the page, and what shapes and colours mean. */

import { useEffect, useRef } from "preact/hooks";
import { KEYS, helpOpen } from "./keys";

export function Help() {
  const dialog = useRef<HTMLDialogElement>(null);
  useEffect(() => dialog.current!.showModal(), []);
  return (
    <dialog ref={dialog} onClose={() => (helpOpen.value = false)} aria-label="Help">
      <h2>Keys</h2>
      <dl class="facts">
        {KEYS.map(([keys, does]) => (
          <>
            <dt>
              <kbd>{keys}</kbd>
            </dt>
            <dd>{does}</dd>
          </>
        ))}
      </dl>
      <h2>Map</h2>
      <p>
        A square is a structure, a small dot a worker, a disc with a point a fighter that looks there, a pale disc with a rim one that flies. The inner ring is health, the outer one shields. A cross is a
        death, a bright line a shot, a thin line an order. Point at a tag or a place in a text, and the map shows it; point at a unit, and the texts mark it.
      </p>
      <h2>Time line</h2>
      <p>
        Fights are bars, as high as what was lost in them; × a death, ■ a structure, ◆ an upgrade, ● a message, ▲ advice of a person; in red what went wrong: ○ late, △ a fallback, × a refused action, ! an
        incident.
      </p>
      <form method="dialog">
        <button autofocus>Close</button>
      </form>
    </dialog>
  );
}
