// Elements without templates: h("button.primary", {onclick: go}, "Go"); properties may be left out.
export function h(kind, first = {}, ...rest) {
  const [tag, ...classes] = kind.split("."),
    named = first?.constructor === Object,
    [props, children] = named ? [first, rest] : [{}, [first, ...rest]];
  const element = document.createElement(tag);
  if (classes.length) element.className = classes.join(" ");
  for (const [name, value] of Object.entries(props)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name === "class") element.className = value;
    else if (name === "style") for (const [k, v] of Object.entries(value)) element.style.setProperty(k, v);
    else if (name === "value" || name === "checked" || name === "selected" || name === "disabled")
      element[name] = value;
    else element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.flat(3).filter((child) => child !== null && child !== undefined && child !== false));
  return element;
}

export function panel(title, header, ...body) {
  return h("section.panel", h("header", h("h2", title), ...[header].flat()), ...body);
}

// what a view begins with
export const heading = (title, words) => h("div.head", h("h1", title), h("p", words));

// a panel with a word on what it shows
export const described = (title, words, ...body) =>
  panel(title, words ? [h("span.faint", words)] : [], h("div.body", ...body));

// heads: names of the columns, or [name, class, columns it spans]; null for one that is left out, as its cells are.
// rows: lists of what the cells hold, {props, cells} or elements; a cell has its column's class unless it is one already
export function table(props, heads, rows) {
  const named = heads.filter((one) => one !== null).map((one) => [one].flat()),
    columns = named.flatMap(([name, kind, span]) => [[name, kind], ...Array((span ?? 1) - 1).fill(["", kind])]);
  const made = rows.map((row) => (row instanceof Element ? row : tr(columns, row.props ?? {}, row.cells ?? row)));
  for (const row of made)
    for (const [i, cell] of [...row.cells].entries())
      cell.dataset.head = cell.colSpan > 1 ? "" : (columns[i]?.[0] ?? "");
  const head = named.map(([name, kind, span]) => h("th", { class: kind, colspan: span }, name));
  const top = named.some(([name]) => name) ? h("thead", h("tr", head)) : null;
  return h("table", props, top, h("tbody", made));
}

// from edge to edge of its panel
export const wideTable = (...said) => h("div.flush", table(...said));

const tr = (columns, props, cells) => {
  const held = cells.filter((cell) => cell !== null);
  return h(
    "tr",
    props,
    held.map((cell, i) => (cell instanceof HTMLTableCellElement ? cell : h("td", { class: columns[i][1] }, cell))),
  );
};

export const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

export function select(options, chosen, onchange, label) {
  const list = h("select", { onchange: (event) => onchange(event.target.value), "aria-label": label });
  offer(list, options, chosen);
  return list;
}

// what a list offers from now on; what was chosen stays chosen
export const offer = (list, options, chosen = list.value) =>
  fill(
    list,
    options.map(([value, text]) => h("option", { value, selected: value === chosen }, text)),
  );

// a line's name beside its colour; `kind`: dashed, dotted
export function key(color, name, kind = "") {
  const mark = h("i", { class: kind });
  mark.style.borderTopColor = `var(${color})`;
  return h("span.key", mark, name);
}

// replace what an element holds; nothing for null
export const fill = (element, ...children) =>
  element.replaceChildren(
    ...children.flat(3).filter((child) => child !== null && child !== undefined && child !== false),
  );

// draw what may replace the element that has the focus: its successor of the same name has it then
export function keepFocus(draw) {
  const had = document.activeElement ?? document.body;
  if (had === document.body) return draw();
  const called = had.getAttribute("aria-label") ?? had.textContent,
    same = (one) => one.className === had.className && (one.getAttribute("aria-label") ?? one.textContent) === called,
    alike = () => [...document.querySelectorAll(had.localName)].filter(same),
    before = alike();
  draw();
  const now = alike(); // where there are more or fewer of them, the one in its place may be another
  if (document.activeElement !== had && now.length === before.length)
    now[before.indexOf(had)]?.focus({ preventScroll: true });
}
