/** Light or dark: as the system says, or as was chosen here. */

import { computed, effect, signal } from "@preact/signals";

const KEY = "khala-theme";
const system = matchMedia("(prefers-color-scheme: light)");
const systemLight = signal(system.matches);
system.addEventListener("change", () => (systemLight.value = system.matches));

const chosen = signal(stored());
export const theme = computed<"light" | "dark">(() => chosen.value ?? (systemLight.value ? "light" : "dark"));

/** Whether movement is to be spared. */
export const still = matchMedia("(prefers-reduced-motion: reduce)").matches;

export function toggleTheme(): void {
  chosen.value = theme.value === "light" ? "dark" : "light";
  try {
    localStorage.setItem(KEY, chosen.value);
  } catch {
    // a file:// page may keep nothing
  }
}

/** Colours that are drawn on canvases, from the style of the page. */
export const palette = signal(read());
effect(() => {
  document.documentElement.dataset.theme = theme.value;
  palette.value = read();
});

function read() {
  const style = getComputedStyle(document.documentElement);
  const of = (name: string) => style.getPropertyValue(`--${name}`).trim() || "#888";
  return {
    sides: [of("side-0"), of("side-1"), of("side-2")] as [string, string, string],
    ground: of("ground"),
    low: of("ground-low"),
    high: of("ground-high"),
    wall: of("ground-wall"),
    edge: of("ground-edge"),
    creep: of("creep"),
    fog: of("fog"),
    mineral: of("mineral"),
    geyser: of("geyser"),
    shield: of("shield"),
    health: of("health"),
    text: of("text"),
    muted: of("muted"),
    line: of("line"),
    lit: of("lit"),
    letters: of("letters"),
    flash: of("flash"),
    bad: of("bad"),
    good: of("good"),
  };
}

export type Colours = ReturnType<typeof read>;

function stored(): "light" | "dark" | null {
  try {
    const value = localStorage.getItem(KEY);
    return value === "light" || value === "dark" ? value : null;
  } catch {
    return null;
  }
}
