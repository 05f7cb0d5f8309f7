/** What changed between two texts, line by line. */

export interface Line {
  text: string;
  change: "same" | "added" | "removed";
}

/** Lines above which the middle is shown as removed and added: the table of 2000 by 2000 lines takes 20 ms. */
const MOST_LINES = 2000;

/** Return the lines of both texts in order, by their longest common subsequence. */
export function diffLines(before: string, after: string): Line[] {
  const a = before.split("\n");
  const b = after.split("\n");
  let start = 0;
  while (start < a.length && start < b.length && a[start] === b[start]) start++;
  let end = 0;
  while (end < a.length - start && end < b.length - start && a[a.length - 1 - end] === b[b.length - 1 - end]) end++;
  return [
    ...a.slice(0, start).map((text) => line(text, "same")),
    ...middle(a.slice(start, a.length - end), b.slice(start, b.length - end)),
    ...a.slice(a.length - end).map((text) => line(text, "same")),
  ];
}

const line = (text: string, change: Line["change"]): Line => ({ text, change });

function middle(a: string[], b: string[]): Line[] {
  if (a.length > MOST_LINES || b.length > MOST_LINES) return [...a.map((t) => line(t, "removed")), ...b.map((t) => line(t, "added"))];
  const common = lengths(a, b);
  const width = b.length + 1;
  const lines: Line[] = [];
  let [i, j] = [0, 0];
  while (i < a.length || j < b.length) {
    if (i < a.length && j < b.length && a[i] === b[j]) {
      lines.push(line(a[i++], "same"));
      j++;
    } else if (j >= b.length || (i < a.length && common[(i + 1) * width + j] >= common[i * width + j + 1])) {
      lines.push(line(a[i++], "removed"));
    } else lines.push(line(b[j++], "added"));
  }
  return lines;
}

/** Return for each pair of ends how many lines they have in common, row after row. */
function lengths(a: string[], b: string[]): Uint16Array {
  const width = b.length + 1;
  const common = new Uint16Array((a.length + 1) * width);
  for (let i = a.length - 1; i >= 0; i--)
    for (let j = b.length - 1; j >= 0; j--)
      common[i * width + j] =
        a[i] === b[j] ? common[(i + 1) * width + j + 1] + 1 : Math.max(common[(i + 1) * width + j], common[i * width + j + 1]);
  return common;
}
