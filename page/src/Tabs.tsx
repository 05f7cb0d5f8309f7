/** A list of tabs: arrow keys change the tab, as the ARIA practices say. */

import type { ComponentChildren } from "preact";

export interface Tab {
  id: string;
  name: ComponentChildren;
}

export function Tabs({ label, tabs, chosen, choose, panel }: { label: string; tabs: readonly Tab[]; chosen: string; choose: (id: string) => void; panel: string }) {
  const key = (event: KeyboardEvent) => {
    const by = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!by) return;
    const next = tabs[(tabs.findIndex((t) => t.id === chosen) + by + tabs.length) % tabs.length];
    choose(next.id);
    (event.currentTarget as HTMLElement).querySelector<HTMLElement>(`[data-tab="${next.id}"]`)?.focus();
    event.preventDefault();
    event.stopPropagation();
  };
  return (
    <div class="tabs" role="tablist" aria-label={label} onKeyDown={key}>
      {tabs.map((tab) => (
        <button
          key={tab.id}
          role="tab"
          id={`${panel}-${tab.id}`}
          data-tab={tab.id}
          aria-selected={tab.id === chosen}
          aria-controls={panel}
          tabIndex={tab.id === chosen ? 0 : -1}
          onClick={() => choose(tab.id)}
        >
          {tab.name}
        </button>
      ))}
    </div>
  );
}
