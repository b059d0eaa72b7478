// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Elements and texts. Text from a log becomes text nodes only, never HTML.

type Child = Node | string | null | false;
type Attributes = { class?: string; title?: string; type?: string; id?: string; [name: string]: string | undefined };

export function el<K extends keyof HTMLElementTagNameMap>(tag: K, attributes: Attributes = {},
    ...children: Child[]): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) if (value !== undefined) element.setAttribute(name, value);
  element.append(...children.filter((child): child is Node | string => child !== null && child !== false));
  return element;
}

export function button(text: string, title: string, act: () => void, name = ""): HTMLButtonElement {
  const made = el("button", { type: "button", title, class: name || undefined }, text);
  made.addEventListener("click", act);
  return made;
}

export const kIcons = { first: "M3 3h2v10H3z M13 3v10L6 8z", back: "M11 3v10L4 8z", play: "M4 2.5v11L13 8z",
    pause: "M3.5 3h3v10h-3z M9.5 3h3v10h-3z",
  forward: "M5 3v10l7-5z", last: "M11 3h2v10h-2z M3 3v10l7-5z" };
export function icon(name: keyof typeof kIcons, title: string, act: () => void): HTMLButtonElement {
  const made = button("", title, act, `icon ${name}`),
      svg = document.createElementNS("http://www.w3.org/2000/svg", "svg"),
      path = document.createElementNS(svg.namespaceURI, "path");
  svg.setAttribute("viewBox", "0 0 16 16");
  path.setAttribute("d", kIcons[name]);
  svg.append(path);
  made.append(svg);
  return made;
}

// A row of choices of which one is on.
export class Choice<T extends string> {
  readonly root = el("div", { class: "choice" });
  private readonly buttons = new Map<T, HTMLButtonElement>();
  constructor(values: readonly (readonly [T, string, string])[], private readonly pick: (value: T) => void) {
    for (const [value, text, title] of values) {
      const made = button(text, title, () => this.pick(value));
      made.dataset.value = value;
      this.buttons.set(value, made);
      this.root.append(made);
    }
  }
  show(value: T): void { for (const [key, made] of this.buttons) made.classList.toggle("on", key === value); }
}

export function select(values: readonly (readonly [string, string])[], title: string,
    act: (value: string) => void): HTMLSelectElement {
  const made = el("select", { title }, ...values.map(([value, text]) => el("option", { value }, text)));
  made.addEventListener("change", () => act(made.value));
  return made;
}

export function toggle(text: string, title: string, act: () => void, color = ""): HTMLButtonElement {
  const made = button(text, title, act, "toggle");
  if (color) made.prepend(Object.assign(el("i"), { style: `background:${color}` }));
  return made;
}

export const setText = (element: Element, text: string): void => {
    if (element.textContent !== text) element.textContent = text; };

// ---- numbers as text
export const fixed = (value: number | undefined, digits: number): string =>
  value === undefined || !Number.isFinite(value) ? "\u2013" : value.toFixed(digits);
export const degrees = (rad: number): string => fixed(rad * 180 / Math.PI, 1);
// The id of a track as slot:generation; the whole id is its title.
export function shortId(id: string): string {
  const value = BigInt(id);
  return `${value & 0xffffffffn}:${value >> 32n}`;
}
export const bytesText = (bytes: number): string =>
    (bytes >= 1e9 ? `${fixed(bytes / 1e9, 2)} GB` : bytes >= 1e6 ? `${fixed(bytes / 1e6, 1)} MB`
    : `${fixed(bytes / 1e3, 1)} kB`);
export function clockText(seconds: number): string {
  const minutes = Math.floor(seconds / 60);
  return `${minutes}:${(seconds - 60 * minutes).toFixed(3).padStart(6, "0")}`;
}
