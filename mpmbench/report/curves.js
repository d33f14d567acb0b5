// Switches the curves of a figure and reads them off, by pointer and by keyboard. A curve is the group
// whose identifier ends in curve-NUMBER-PANEL; data-axes says where its axes lie in the drawing.
"use strict";
const NEAR = 40; // how far from a point it is read off, in units of the drawing

function pointsOf(group) {
  const line = [...group.children].find(one => one.tagName === "path");
  if (line) {
    const numbers = line.getAttribute("d").match(/-?\d+(\.\d+)?/g) || [];
    return Array.from({length: numbers.length >> 1}, (_, k) => [+numbers[2 * k], +numbers[2 * k + 1]]);
  }
  return [...group.querySelectorAll("use")].map(one => [+one.getAttribute("x"), +one.getAttribute("y")]);
}

function valueAt(axis, share) {
  const [from, to] = axis.log ? axis.limits.map(Math.log10) : axis.limits;
  const value = from + share * (to - from);
  return Number((axis.log ? 10 ** value : value).toPrecision(3)).toString();
}

function live(figure) {
  const drawing = figure.querySelector("svg"), said = figure.querySelector("output");
  const axes = JSON.parse(figure.dataset.axes);
  const curves = [...drawing.querySelectorAll('g[id*="curve-"]')].map(group => {
    const [, number, panel] = /curve-(\d+)-(\d+)$/.exec(group.id);
    return {group, number, panel: +panel, points: pointsOf(group), shown: true};
  });
  const buttons = [...figure.querySelectorAll("button[data-curve]")];
  const nameOf = new Map(buttons.map(one => [one.dataset.curve, one.textContent.trim()]));
  const mark = document.createElementNS("http://www.w3.org/2000/svg", "circle");
  mark.setAttribute("class", "mark");
  mark.setAttribute("r", "4");

  function read(curve, [x, y]) {
    const axis = axes[curve.panel], [left, right, bottom, top] = axis.edges;
    const at = valueAt(axis.x, (x - left) / (right - left)), value = valueAt(axis.y, (y - bottom) / (top - bottom));
    said.textContent = `${nameOf.get(curve.number)}: ${axis.y.words} ${value} at ${axis.x.words} ${at}`;
    mark.setAttribute("cx", x);
    mark.setAttribute("cy", y);
    drawing.append(mark);
  }

  drawing.addEventListener("pointermove", event => {
    const place = new DOMPoint(event.clientX, event.clientY).matrixTransform(drawing.getScreenCTM().inverse());
    let nearest = NEAR, found = null;
    for (const curve of curves.filter(one => one.shown)) {
      for (const point of curve.points) {
        const away = Math.hypot(point[0] - place.x, point[1] - place.y);
        if (away < nearest) [nearest, found] = [away, [curve, point]];
      }
    }
    if (found) read(...found);
  });
  drawing.addEventListener("pointerleave", () => mark.remove());

  buttons.forEach((button, place) => {
    const own = curves.filter(one => one.number === button.dataset.curve);
    const points = own.flatMap(curve => curve.points.map(point => [curve, point]));
    let at = -1;
    button.addEventListener("click", () => {
      const shown = button.getAttribute("aria-pressed") !== "true";
      button.setAttribute("aria-pressed", shown);
      own.forEach(curve => {
        curve.shown = shown;
        curve.group.style.display = shown ? "" : "none";
      });
      mark.remove();
    });
    button.addEventListener("keydown", event => {
      const step = {ArrowRight: 1, ArrowLeft: -1}[event.key];
      if (step && points.length) {
        at = (at + step + points.length) % points.length;
        read(...points[at]);
        event.preventDefault();
      }
    });
  });
}

document.documentElement.classList.add("live");
document.querySelectorAll("figure[data-axes]").forEach(live);
