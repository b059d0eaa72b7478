// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A table that sorts by a click on a head and calls back for a click on a row.
import { el, setText } from "./dom";

export interface Column<Row> { title: string; hint?: string; value: (row: Row) => number | string;
    text?: (row: Row) => string; words?: boolean }

export class DataTable<Row> {
  readonly root = el("table", { class: "data" });
  private readonly heads: HTMLElement[] = [];
  private readonly body = el("tbody");
  private sortBy = -1;
  private direction = 1;
  private rows: Row[] = [];
  private shown: Row[] = [];
  private isPicked: (row: Row) => boolean = () => false;

  constructor(private readonly columns: Column<Row>[], private readonly pick: (row: Row) => void = () => {},
      private readonly rowClass: (row: Row) => string = () => "") {
    columns.forEach((column, i) => {
      const head = el("th", { title: column.hint ?? column.title, class: column.words ? "words" : undefined },
          column.title);
      head.addEventListener("click", () => {
        this.direction = this.sortBy === i ? -this.direction : column.words ? 1 : -1;
        this.sortBy = i;
        this.draw();
      });
      this.heads.push(head);
    });
    this.root.append(el("thead", {}, el("tr", {}, ...this.heads)), this.body);
    this.body.addEventListener("click", (e) => {
      const tr = (e.target as Element).closest("tr");
      const row = tr && this.shown[[...this.body.children].indexOf(tr)];
      if (row) this.pick(row);
    });
  }

  set(rows: Row[], isPicked: (row: Row) => boolean = () => false): void {
    this.rows = rows;
    this.isPicked = isPicked;
    this.draw();
  }

  private draw(): void {
    const column = this.columns[this.sortBy];
    this.shown = column ? [...this.rows].sort((a, b) => {
      const x = column.value(a), y = column.value(b);
      return this.direction * (typeof x === "string" || typeof y === "string"
          ? String(x).localeCompare(String(y), "en", { numeric: true }) : Number.isNaN(x) ? 1 : Number.isNaN(y) ? -1
          : x - y);
    }) : this.rows;
    this.heads.forEach((head, i) => { head.dataset.sort = i === this.sortBy ? (this.direction > 0 ? "up" : "down") : "";
        });
    while (this.body.children.length > this.shown.length) this.body.lastElementChild!.remove();
    this.shown.forEach((row, i) => {
      const tr = this.body.children[i] ?? this.body.appendChild(
          el("tr", {}, ...this.columns.map((c) => el("td", { class: c.words ? "words" : undefined }))));
      tr.className = `${this.rowClass(row)}${this.isPicked(row) ? " picked" : ""}`;
      this.columns.forEach((c, k) => setText(tr.children[k], c.text ? c.text(row) : String(c.value(row))));
    });
  }
}
