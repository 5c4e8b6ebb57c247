// The pictures of the report: errors over time, and what was to be seen when.

import { Chart, Legend, LinearScale, LineController, LineElement, LogarithmicScale, PointElement, Title } from "chart.js";

Chart.register(Legend, LinearScale, LineController, LineElement, LogarithmicScale, PointElement, Title);

/** Draws `curves`, each `{ label, colour, points: { x: seconds, y: percent }[] }`, on a canvas of its own; returns when it is there. */
export function chart(title, curves, most) {
  const canvas = emptied("canvas");
  Object.assign(canvas, { width: 900, height: 460 });
  const scale = (text) => ({ title: { display: true, text }, grid: { color: "#ddd" } });
  new Chart(canvas, {
    type: "line",
    data: {
      datasets: curves.map(({ label, colour, points, dashed }) => ({
        ...{ label, data: points, borderColor: colour, backgroundColor: colour, stepped: "before", borderWidth: 2 },
        ...{ pointRadius: dashed ? 0 : 2, borderDash: dashed ? [5, 4] : [] },
      })),
    },
    options: {
      animation: false,
      responsive: false,
      devicePixelRatio: 1,
      parsing: false,
      plugins: { title: { display: true, text: title, font: { size: 15 } }, legend: { position: "bottom" } },
      scales: {
        x: { type: "linear", min: 0, max: most, ...scale("seconds since load()") },
        y: { type: "logarithmic", ...scale("largest error, of the diagonal"), ticks: { callback: (percent) => `${percent} %` } },
      },
    },
  });
}

/** Lays out `rows`, each `{ label, cells: { picture, text }[] }`, below `times`. */
export function sheet(times, rows, width, height) {
  const table = emptied("table");
  table.style.cssText = "border-spacing: 3px; font: 13px system-ui, 'Liberation Sans', sans-serif; background: #fff; color: #222";
  const cell = (content, style = "") => {
    const td = document.createElement("td");
    td.style.cssText = `padding: 0; text-align: center; ${style}`;
    td.append(content);
    return td;
  };
  const row = (...cells) => {
    const tr = document.createElement("tr");
    tr.append(...cells);
    table.append(tr);
  };
  row(cell(""), ...times.map((time) => cell(`${time / 1000} s`, "font-weight: 600")));
  for (const { label, cells } of rows) {
    const pictures = cells.map(({ picture }) => {
      const box = `width: ${width}px; height: ${height}px; background: #15181d; color: #8a919c`;
      if (!picture) return cell("nothing yet", box);
      return cell(Object.assign(new Image(width, height), { src: picture, style: "display: block" }), box);
    });
    row(cell(label, "font-weight: 600; padding-right: 6px; text-align: left"), ...pictures);
    row(cell(""), ...cells.map(({ text }) => cell(text, "font-size: 12px; padding-bottom: 6px")));
  }
}

function emptied(name) {
  document.body.replaceChildren(document.createElement(name));
  document.body.firstChild.id = "picture";
  return document.body.firstChild;
}
