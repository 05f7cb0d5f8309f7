/** Numbers and names as the page writes them. */

const WHOLE = new Intl.NumberFormat("en", { maximumFractionDigits: 0 });
const SHORT = new Intl.NumberFormat("en", { notation: "compact", maximumFractionDigits: 1 });

/** Return a number without decimals, `1,250`; a dash if it is unknown. */
export const whole = (value: number | null | undefined) => (value == null ? "–" : WHOLE.format(value));

/** Return a number in a few characters, `12.5K`; a dash if it is unknown. */
export const short = (value: number | null | undefined) => (value == null ? "–" : SHORT.format(value));

/** Return money, with as many decimals as it takes to see something. */
export function dollars(value: number | null | undefined): string {
  if (value == null) return "–";
  return `$${value.toFixed(value === 0 || value >= 1 ? 2 : value >= 0.01 ? 3 : 5)}`;
}

/** Return a ratio as K/D is written; `∞` if nothing was lost. */
export function ratio(killed: number, lost: number): string {
  if (lost > 0) return (killed / lost).toFixed(2);
  return killed > 0 ? "∞" : "–";
}

/** Return seconds of thinking, `45 ms` or `3.2 s`. */
export function seconds(value: number | null | undefined): string {
  if (value == null) return "–";
  return value < 1 ? `${Math.round(value * 1000)} ms` : `${value.toFixed(value < 10 ? 1 : 0)} s`;
}

/** Return bytes, `4.2 MB`. */
export function bytes(value: number): string {
  const power = Math.min(Math.floor(Math.log10(Math.max(value, 1)) / 3), 3);
  return `${(value / 1000 ** power).toFixed(power ? 1 : 0)} ${["B", "kB", "MB", "GB"][power]}`;
}

/** Return a number with its noun, `1 step`, `2 steps`. */
export const count = (n: number, noun: string) => `${WHOLE.format(n)} ${noun}${n === 1 ? "" : "s"}`;

/** Return a name of the wire as words, `combat group`. */
export const spaced = (name: string) => name.replaceAll("_", " ");

/** Return a name with a capital, `Blue`. */
export const capital = (name: string) => name.charAt(0).toUpperCase() + name.slice(1);

/** Return a tag as agents write it. */
export const hex = (tag: number) => `0x${tag.toString(16)}`;
