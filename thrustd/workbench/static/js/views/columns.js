// What the columns of a file are: name, unit, zero and sign of each, with a preview before anything is taken.

import { inUrl, Problem, put } from "../api.js";
import { MEANT, OTHERS, ROLES, unitOf } from "../channels.js";
import { columnPictures, correlation } from "../column_pictures.js";
import { fill, h, select, wideTable } from "../dom.js";
import { newtons, number, withUnit } from "../format.js";
import { attempt, recording, refresh, say } from "../store.js";

const STILL_LOADED = 0.02; // of the largest force: a reading there is no zero
const MAY_BE_OFF = ["force_N", "deformation_mm"]; // what has a reading without load

export class Columns {
  constructor(root, name, table, done) {
    Object.assign(this, { root, name, table, done });
    const { mapped } = recording(name);
    this.only = table.only;
    this.rate = mapped.rate_hz ?? "";
    this.rows = table.columns.map((column) => {
      const kept = (column.file ? table.said : mapped.columns)?.find((one) => one.theirs === column.name),
        one = kept ?? table.offered[column.name],
        row = { column, ours: one?.ours ?? "", unit: one?.unit || column.unit, sign: 1, zero: "", scale: "" };
      if (one) this.take(row, one, Boolean(kept));
      return row;
    });
    this.picture = h("div.columns");
    this.verdict = h("p", { role: "status" });
  }

  // factor and offset as a person says them: unit, sign, reading without load
  take(row, { factor, offset }, said) {
    const [scale, shift] = this.conversion(row) ?? [Math.abs(factor), 0];
    row.sign = factor < 0 ? -1 : 1;
    row.scale = this.conversion(row) || !said ? "" : scale;
    row.zero = this.raw(row) && !said ? "" : Number((-(offset - shift) / factor).toPrecision(12)) || 0;
  }

  conversion = (row) => this.table.conversions[unitOf(row.ours)]?.[row.unit];

  // what a transducer says, in a unit of its own: scale and zero are for its calibration sheet to say
  raw = (row) => Boolean(row.ours) && !this.conversion(row);

  // [factor, offset] of ours = theirs * factor + offset
  numbers(row) {
    const [scale, shift] = this.conversion(row) ?? [Number(row.scale || 1), 0],
      factor = row.sign * scale;
    return [factor, shift - (row.zero || 0) * factor];
  }

  values(row) {
    const [factor, offset] = this.unsaid(row) ? [1, 0] : this.numbers(row);
    return row.column.preview.map((v) => (v === null ? null : v * factor + offset));
  }

  draw() {
    const shown = this.asked(),
      strange = shown.filter((row) => !row.column.known),
      known = shown.filter((row) => row.column.known).map((row) => row.column.name);
    const heads = [["Column", "name"], "Is", "In", "Zero: reading without load", "Sign", "Becomes"];
    fill(
      this.root,
      h(
        "header",
        h("h2", `Columns of ${this.name}`),
        h("span.faint", "the file stays as it is; a column is read the same way in every file of the folder"),
        h(
          "span.push.buttons",
          this.alone(),
          h("button", { onclick: () => this.done() }, "Close"),
          h(
            "button",
            { class: "primary", id: "take-columns", onclick: attempt(() => this.keep()) },
            "Use these columns",
          ),
        ),
      ),
      wideTable(
        { class: "mapping" },
        heads,
        strange.map((row) => this.row(row)),
      ),
      this.rows.some((row) => row.ours === "time_s" && !row.column.file) || this.table.timed ? null : this.sampled(),
      known.length ? h("p.idle", h("b", "Kept as named: "), known.join(", ")) : null,
      h("div.body", this.verdict, this.picture),
    );
    this.preview();
  }

  // with the rows of the folder's other files, unless it is named alone
  asked = () => this.rows.filter((row) => !(this.only && row.column.file));

  // another zero, another transducer under the same name
  alone() {
    const set = (event) => {
      this.only = event.target.checked;
      this.draw();
    };
    return h("label.inline", h("input", { type: "checkbox", checked: this.only, onchange: set }), " in this file only");
  }

  sampled() {
    return h(
      "label.body.toolbar",
      "No column of time: ",
      h("input", {
        type: "number",
        value: this.rate,
        placeholder: "100",
        "aria-label": "samples per second",
        oninput: (event) => {
          this.rate = event.target.value;
        },
      }),
      "samples per second",
    );
  }

  row(row) {
    const { column } = row,
      there = new Set(this.table.columns.map((one) => one.name));
    const choices = [...ROLES, ...OTHERS].filter((ours) => ours === row.ours || !there.has(ours));
    const set = (field) => (value) => {
      row[field] = value;
      this.draw();
    };
    const becomes = h("span", row.ours ? this.becomes(row) : null);
    const field = (name, label) =>
      h("input", {
        type: "number",
        step: "any",
        value: row[name],
        "aria-label": `${label} of ${column.name}`,
        oninput: (event) => {
          document.dispatchEvent(new CustomEvent("attempt"));
          row[name] = event.target.value === "" ? "" : Number(event.target.value);
          fill(becomes, this.becomes(row));
          this.preview();
        },
      });
    const cells = row.ours
      ? [
          h(
            "span.inline",
            this.units(row, set("unit")),
            this.raw(row) && row.unit ? [` 1 ${row.unit} = `, field("scale", "scale"), unitOf(row.ours)] : null,
          ),
          MAY_BE_OFF.includes(row.ours) || this.raw(row) || row.zero
            ? [h("span.inline", field("zero", "zero"), row.unit), this.zeroOffered(row, set("zero"))]
            : "",
          row.ours === "time_s"
            ? ""
            : h(
                "label.inline",
                h("input", {
                  type: "checkbox",
                  checked: row.sign < 0,
                  "aria-label": `reverse the sign of ${column.name}`,
                  onchange: (event) => set("sign")(event.target.checked ? -1 : 1),
                }),
                " reversed",
              ),
          becomes,
        ]
      : ["", "", "", h("span.faint", "kept under its own name")];
    return [
      [
        h("b", column.name),
        column.file ? h("div.faint", `in ${column.file}`) : null,
        h("div.faint", `${number(column.low, 4)} to ${withUnit(column.high, column.unit, 4)}`),
      ],
      [
        select(
          [["", "as named"], ...choices.map((o) => [o, o])],
          row.ours,
          (ours) => {
            Object.assign(row, { ours, scale: "", zero: "" });
            this.draw();
          },
          `what ${column.name} is`,
        ),
        row.ours in MEANT ? h("div.faint", MEANT[row.ours]) : null,
      ],
      ...cells,
    ];
  }

  units(row, pick) {
    const known = Object.keys(this.table.conversions[unitOf(row.ours)] ?? {}),
      own = [row.column.unit, "V"].filter((unit) => unit && !known.includes(unit));
    const options = [...known, ...new Set(own)].map((unit) => [unit, unit]);
    return select(row.unit ? options : [["", "unit?"], ...options], row.unit, pick, `unit of ${row.column.name}`);
  }

  becomes(row) {
    if (this.unsaid(row)) return h("span.faint", "?");
    const [factor, offset] = this.numbers(row),
      ends = [row.column.low, row.column.high].map((v) => v * factor + offset).sort((p, q) => p - q);
    return h("span.num", `${number(ends[0], 4)} to ${withUnit(ends[1], unitOf(row.ours), 4)}`);
  }

  // what nobody has said yet: how much of ours one of theirs is, and what it reads without load
  unsaid = (row) => this.raw(row) && (row.scale === "" || row.zero === "");

  // what a transducer says where the force is smallest: a zero to take, or to doubt
  zeroOffered(row, take) {
    const force = this.channel("force_N")?.values;
    if (row.ours !== "deformation_mm" || !force) return null;
    const least = force.reduce(
        (best, v, i) => (Math.abs(v ?? Infinity) < Math.abs(force[best] ?? Infinity) ? i : best),
        0,
      ),
      value = Number(row.column.preview[least]?.toPrecision(3) ?? Number.NaN);
    const loaded = Math.abs(force[least]) > STILL_LOADED * Math.max(...force.map((v) => Math.abs(v ?? 0))),
      words = `${value} at the least force${loaded ? `: ${newtons(force[least])}, still loaded` : ""}`;
    return h("div", h("button", { onclick: () => take(value) }, words));
  }

  // the channel as it would be read, on the preview's samples: {values, title}
  channel(ours) {
    const rows = this.rows.filter((one) => !one.column.file),
      row = rows.find((one) => one.ours === ours) ?? rows.find((one) => !one.ours && one.column.name === ours);
    if (!row) return null;
    const title =
      row.ours && this.unsaid(row)
        ? row.column.name
        : { force_N: "force [N]", deformation_mm: "deformation [mm]" }[ours];
    return { values: row.ours ? this.values(row) : row.column.preview, title };
  }

  preview() {
    const [time, force, deformation] = ROLES.map((ours) => this.channel(ours));
    const missing = [
      ["force_N", force],
      ["deformation_mm", deformation],
    ].filter(([, values]) => !values);
    const slope = force && deformation ? correlation(deformation.values, force.values) : null;
    const unsaid = this.asked().filter(this.unsaid).map(question);
    this.verdict.className = slope !== null && slope < 0 ? "bad" : "quiet";
    this.verdict.textContent = [
      slope === null
        ? missing.length
          ? `Not said yet: ${missing.map(([name]) => name).join(" and ")}.`
          : ""
        : slope < 0
          ? "The force falls while the deformation grows: one of the two signs is reversed."
          : `The force rises with the deformation: the signs agree${this.turned()}.`,
      ...unsaid,
    ].join(" ");
    fill(this.picture, columnPictures(time, force, deformation, slope));
  }

  turned() {
    const names = this.rows.filter((row) => row.sign < 0).map((row) => row.column.name);
    return names.length ? `, with ${names.join(" and ")} reversed` : "";
  }

  async keep() {
    const unsaid = this.asked().find(this.unsaid);
    if (unsaid) throw new Problem(question(unsaid));
    const columns = this.asked()
      .filter((row) => row.ours && row.ours !== row.column.name)
      .map((row) => {
        const [factor, offset] = this.numbers(row);
        return { theirs: row.column.name, ours: row.ours, factor, offset };
      });
    const body = {
      columns,
      rate_hz: this.rate === "" || columns.some((c) => c.ours === "time_s") ? null : Number(this.rate),
    };
    await put(`api/columns/${inUrl(this.name)}${this.only ? "?only=1" : ""}`, JSON.stringify(body));
    say(
      `${this.only ? this.name : "In every file"}: ${columns.map((c) => `${c.theirs} is ${c.ours}`).join(", ")}`,
      "ok",
    );
    this.done();
    await refresh();
  }
}

const question = (row) =>
  !row.unit
    ? `In what unit is ${row.column.name}?`
    : row.scale === ""
      ? `How many ${unitOf(row.ours)} is 1 ${row.unit} of ${row.column.name}? Its calibration sheet says.`
      : `What does ${row.column.name} read without load? Type 0 if it was zeroed.`;
