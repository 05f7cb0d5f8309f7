/** A text of a model or for one: always text nodes, with the units and places that it speaks of to point at. */

import { useMemo } from "preact/hooks";
import { references, type Piece, type Screen } from "../references";
import { spoken } from "../stage";

/** Show a text; `quiet` keeps its references out of the order of the tab key, for texts with hundreds of them. */
export function Words({ text, screens, frame, quiet = false }: { text: string; screens?: readonly Screen[]; frame?: "minimap"; quiet?: boolean }) {
  const pieces = useMemo(() => references(text, screens, frame), [text, screens, frame]);
  return <>{pieces.map((piece, i) => (isReference(piece) ? <Reference key={i} piece={piece} quiet={quiet} /> : piece.text))}</>;
}

const isReference = (piece: Piece) => piece.tag !== undefined || piece.at !== undefined;

function Reference({ piece, quiet }: { piece: Piece; quiet: boolean }) {
  const point = () => pointAt(piece.tag === undefined ? [] : [piece.tag], piece.at ? [piece.at] : []);
  return (
    <span class="reference" data-tag={piece.tag} tabIndex={quiet ? -1 : 0} onPointerEnter={point} onPointerLeave={pointAway} onFocus={point} onBlur={pointAway}>
      {piece.text}
    </span>
  );
}

/** Light up units and places on the map. */
export function pointAt(tags: readonly number[], at: readonly (readonly [number, number])[]): void {
  spoken.value = { tags, at };
}

export function pointAway(): void {
  spoken.value = null;
}

/** Move between the references of a long text by the arrow keys left and right. */
export function alongReferences(event: KeyboardEvent): void {
  if (event.key !== "ArrowRight" && event.key !== "ArrowLeft") return;
  const all = [...(event.currentTarget as HTMLElement).querySelectorAll<HTMLElement>(".reference")];
  if (!all.length) return;
  const now = all.indexOf(document.activeElement as HTMLElement);
  const next = now < 0 ? 0 : (now + (event.key === "ArrowRight" ? 1 : all.length - 1)) % all.length;
  all[next].focus();
  all[next].scrollIntoView({ block: "nearest" });
  event.preventDefault();
  event.stopPropagation();
}
