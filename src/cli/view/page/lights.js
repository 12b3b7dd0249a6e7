// The lights: a slider for each, from 1/64 to 64 times as bright, or none.

const MOST = 24;
const factor = gain => `× ${+gain.toPrecision(3)}`;
const $ = id => document.getElementById(id);

export class Lights {
  constructor(ask) {
    this.ask = ask;
    this.touched = -Infinity;
    $("lights-reset").onclick = () => { this.touched = -Infinity; ask({ do: "lights", gains: this.gains.map(() => 1) }); };
  }
  /** The lights of a scene. */
  known(lights) {
    this.gains = lights.map(() => 1);
    $("lights").replaceChildren(...lights.slice(0, MOST).map((light, i) => {
      const row = document.createElement("label"), range = document.createElement("input"), says = document.createElement("output");
      Object.assign(range, { type: "range", min: -6, max: 6, step: 0.25, value: 0 });
      range.setAttribute("aria-label", `${light.name}, as a factor`);
      row.title = `radiance ${light.radiance.join(", ")}`;
      says.textContent = factor(1);
      range.oninput = () => {
        this.gains[i] = range.value <= -6 ? 0 : 2 ** range.value;
        says.textContent = factor(this.gains[i]);
        this.touched = performance.now();
        clearTimeout(this.sent);
        this.sent = setTimeout(() => this.ask({ do: "lights", gains: this.gains }), 40);
      };
      row.append(light.name, range, says);
      return row;
    }));
    const more = lights.length - MOST;
    if (more > 0) $("lights").append(Object.assign(document.createElement("p"), { textContent: `and ${more} more, without a slider` }));
    $("lights-head").hidden = !lights.length;
  }
  /** What the server looks at, also by other pages; a slider that is being moved counts more. */
  take(gains) {
    $("lights-reset").disabled = gains.every(gain => gain === 1);
    if (performance.now() - this.touched < 600) return;
    this.gains = this.gains.map((_, i) => gains[i] ?? 1);
    document.querySelectorAll("#lights input").forEach((range, i) => {
      range.value = this.gains[i] > 0 ? Math.log2(this.gains[i]) : -6;
      range.nextSibling.textContent = factor(this.gains[i]);
    });
  }
}
