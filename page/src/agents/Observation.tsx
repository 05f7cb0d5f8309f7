/** What an agent saw: its text, the pictures as they were sent, and what changed since the step before. */

import { useSignal } from "@preact/signals";
import { useEffect, useMemo, useState } from "preact/hooks";
import { picture } from "../api";
import { diffLines, type Line } from "../diff";
import type { DecisionTexts, ImageRef, SeenTeam } from "../wire";
import { Words, alongReferences } from "./Words";

/** Lines around a change that are shown with it. */
const AROUND = 2;

export function Observation({ run, asked, screens }: { run: string; asked: DecisionTexts; screens: readonly SeenTeam[] }) {
  const changes = useSignal(false);
  return (
    <>
      {asked.before !== null && (
        <label class="choice">
          <input type="checkbox" checked={changes.value} onChange={() => (changes.value = !changes.value)} /> Only what changed since its observation before
        </label>
      )}
      {asked.images.map((image) => (
        <Picture key={image.sha256} run={run} image={image} />
      ))}
      <pre class="long" onKeyDown={alongReferences} tabIndex={0} aria-label="Observation; arrow keys go from unit to unit">
        {changes.value && asked.before !== null ? <Changes before={asked.before} after={asked.text} screens={screens} /> : <Words text={asked.text} screens={screens} quiet />}
      </pre>
    </>
  );
}

/** Show a picture as it was sent. */
export function Picture({ run, image }: { run: string; image: ImageRef }) {
  const [source, setSource] = useState("");
  useEffect(() => void picture(run, image.sha256).then(setSource, () => setSource("")), [run, image.sha256]);
  return (
    <figure>
      {source && <img src={source} alt={image.title || image.name} width={image.width} height={image.height} loading="lazy" />}
      <figcaption>
        {image.title || image.name} <span class="muted">{`${image.width} × ${image.height}`}</span>
      </figcaption>
    </figure>
  );
}

const MARKS = { same: "  ", added: "+ ", removed: "− " } as const;

function Changes({ before, after, screens }: { before: string; after: string; screens: readonly SeenTeam[] }) {
  const lines = useMemo(() => nearChanges(diffLines(before, after)), [before, after]);
  if (!lines.length) return <>Nothing has changed.</>;
  return (
    <>
      {lines.map((line, i) => (
        <span key={i} class={`line ${line.change}`}>
          {MARKS[line.change]}
          <Words text={line.text} screens={screens} quiet />
          {"\n"}
        </span>
      ))}
    </>
  );
}

/** Return the changed lines with some around them, and a mark where others are left out. */
function nearChanges(lines: readonly Line[]): Line[] {
  const near = lines.map((_, i) => lines.slice(Math.max(0, i - AROUND), i + AROUND + 1).some((l) => l.change !== "same"));
  return lines.flatMap((line, i): Line[] => (near[i] ? [line] : near[i - 1] ? [{ text: "⋯", change: "same" }] : []));
}
