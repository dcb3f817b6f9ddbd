"use strict";
const FRAMES_PER_S = 20 / 3; // as `wsm film` runs
const AHEAD = 8;
const query = words();
const ofSource = "container" in query;
const base = ofSource ? "episode" : "clip";
const frameBase = ofSource ? "episode/frame" : "frame";
const own = ofSource ? { container: query.container, key: query.key } : { key: query.key ?? "", ...(query.side ? { side: query.side } : {}) };
const pictures = { rgb: new Map(), depth: new Map() };
let clip = null;
let map = null;
let at = 0;
let timer = null;

start(async () => {
  await pageHead(ofSource ? "source" : "grid", query.key ?? "");
  clip = await ask(base, own);
  byId("facts").textContent = Object.entries(clip.texts).map(([name, value]) => `${name.replaceAll("_", " ")} ${value}`).join(" · ");
  document.documentElement.style.setProperty("--aspect", `${clip.width} / ${clip.height}`);
  byId("depth-figure").hidden = !clip.has_depth;
  byId("depth-range").textContent = clip.depth_m.map((one) => `${one} m`).join(" to ");
  byId("slider").max = clip.frames - 1;
  fillFacts();
  map = ofSource ? null : await loaded(address("/api/map", own)).catch(() => null);
  fillKey();
  byId("slider").addEventListener("input", () => show(Number(byId("slider").value)));
  byId("play").addEventListener("click", toggle);
  document.addEventListener("keydown", onKey);
  addEventListener("resize", drawMap);
  await show(Math.min(Number(query.frame ?? 0) || 0, clip.frames - 1));
  await neighbours();
});

function loaded(source) {
  return new Promise((done, failed) => {
    const image = new Image();
    image.onload = () => done(image);
    image.onerror = () => failed(new Error(source));
    image.src = source;
  });
}

function frame(kind, number) {
  if (!pictures[kind].has(number)) pictures[kind].set(number, loaded(address(`/api/${frameBase}`, { ...own, kind, number })));
  return pictures[kind].get(number);
}

async function show(number) {
  at = Math.max(0, Math.min(clip.frames - 1, number));
  const wanted = at;
  byId("slider").value = at;
  const left = clip.distance_m.length ? `, ${clip.distance_m[at].toFixed(2)} m to the goal region` : "";
  byId("frame").textContent = `frame ${at} of 0 to ${clip.frames - 1}${left}`;
  drawMap();
  const kinds = clip.has_depth ? ["rgb", "depth"] : ["rgb"];
  try {
    const found = await Promise.all(kinds.map((kind) => frame(kind, wanted)));
    if (wanted === at) kinds.forEach((kind, place) => { byId(kind).src = found[place].src; byId(kind).hidden = false; });
    for (let next = wanted + 1; next <= Math.min(wanted + AHEAD, clip.frames - 1); next += 1) for (const kind of kinds) frame(kind, next).catch(() => null);
  } catch {
    pause();
    kinds.forEach((kind) => { byId(kind).hidden = true; });
    await ask(frameBase, { ...own, kind: "rgb", number: wanted }).catch((error) => notice(error.message));
  }
}

function toggle() {
  if (timer) pause();
  else {
    if (at >= clip.frames - 1) at = -1;
    byId("play").textContent = "❚❚";
    let busy = false;
    timer = setInterval(async () => {
      if (busy) return;
      if (at >= clip.frames - 1) { pause(); return; }
      busy = true;
      await show(at + 1);
      busy = false;
    }, 1000 / FRAMES_PER_S);
  }
}

function pause() {
  clearInterval(timer);
  timer = null;
  byId("play").textContent = "▶";
}

function onKey(event) {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const many = event.shiftKey ? 10 : 1;
  const moves = { ArrowLeft: at - many, ArrowRight: at + many, Home: 0, End: clip.frames - 1 };
  if (event.key in moves) { pause(); show(moves[event.key]); }
  else if (event.key === " ") toggle();
  else if (event.key === "p" && byId("previous").href) location.href = byId("previous").href;
  else if (event.key === "n" && byId("next").href) location.href = byId("next").href;
  else if (event.key === "Escape") location.href = ofSource ? "/source" : address("/grid", listQuery());
  else return;
  event.preventDefault();
}

const listQuery = () => Object.fromEntries(Object.entries(query).filter(([name]) => !["key", "side", "frame"].includes(name)));

async function neighbours() {
  if (ofSource || query.side) { document.querySelector(".pager").hidden = true; return; }
  const found = await ask("around", { ...listQuery(), key: query.key });
  byId("place").textContent = found.place === null ? "" : `${(found.place + 1).toLocaleString("en")} of ${found.total.toLocaleString("en")}`;
  for (const [id, key] of [["previous", found.previous], ["next", found.next]]) if (key) byId(id).href = address("/clip", { ...listQuery(), key });
}

function fillFacts() {
  byId("list").replaceChildren(...clip.facts.flatMap(([name, value]) => [element("dt", { textContent: name }), element("dd", { textContent: value })]));
  byId("scores-section").hidden = !clip.scores.length;
  byId("scores").replaceChildren(...clip.scores.map((one) => element("tr", {},
    element("th", {}, ...breakable(one.name), element("small", { textContent: one.summary + (one.hard ? ` (${one.hard})` : "") })),
    element("td", { className: "n" }, number(one.value), element("small", { textContent: one.unit })))));
}

function fillKey() {
  const entries = ofSource
    ? [["path", "way"], ["still to go", "to-go"], ["goal", "goal"]]
    : [["free", "free"], ["free, but the robot does not fit", "tight"], ["occupied", "wall"], ["unknown", "unknown"], [`a line every ${clip.map.line_every_m} m to the goal`, "metre"], ["path so far", "way"], ["still to go", "to-go"], ["footprint", "footprint"], ["goal region", "goal"]];
  byId("map-key").replaceChildren(...entries.map(([label, name]) => element("span", {}, element("i", { className: name }), label)));
}

function drawMap() {
  const { columns, rows, path, goal, goal_radius, robot_radius } = clip.map;
  const canvas = byId("map");
  const width = byId("map-figure").clientWidth;
  const side = Math.min(width / columns, (0.62 * innerHeight) / rows);
  const sharp = devicePixelRatio || 1;
  canvas.width = Math.round(columns * side * sharp);
  canvas.height = Math.round(rows * side * sharp);
  canvas.style.width = `${columns * side}px`;
  canvas.style.height = `${rows * side}px`;
  const pen = canvas.getContext("2d");
  const scale = side * sharp;
  pen.imageSmoothingEnabled = false;
  hatch(pen, canvas, sharp);
  if (map) pen.drawImage(map, 0, 0, canvas.width, canvas.height);
  const dot = ([x, y], radius) => { pen.beginPath(); pen.arc(x * scale, y * scale, radius, 0, 7); };
  dot(goal, goal_radius * scale);
  pen.fillStyle = "#00796b55";
  pen.fill();
  pen.strokeStyle = "#00796b";
  pen.lineWidth = 2 * sharp;
  pen.stroke();
  line(pen, path.slice(at), scale, "#c9283e66", 2 * sharp);
  line(pen, path.slice(0, at + 1), scale, "#c9283e", 3 * sharp);
  pen.setLineDash([4 * sharp, 3 * sharp]);
  dot(path[at], robot_radius * scale);
  pen.strokeStyle = "#c9283e";
  pen.lineWidth = 1.5 * sharp;
  pen.stroke();
  pen.setLineDash([]);
  dot(path[at], 5 * sharp);
  pen.fillStyle = "#c9283e";
  pen.fill();
}

function line(pen, places, scale, colour, width) {
  pen.beginPath();
  places.forEach(([x, y], number) => (number ? pen.lineTo(x * scale, y * scale) : pen.moveTo(x * scale, y * scale)));
  pen.strokeStyle = colour;
  pen.lineWidth = width;
  pen.lineJoin = "round";
  pen.stroke();
}

function hatch(pen, canvas, sharp) {
  pen.fillStyle = "#e6e9ec";
  pen.fillRect(0, 0, canvas.width, canvas.height);
  pen.strokeStyle = "#aab4bd";
  pen.lineWidth = sharp;
  for (let x = -canvas.height; x < canvas.width; x += 7 * sharp) {
    pen.beginPath();
    pen.moveTo(x, canvas.height);
    pen.lineTo(x + canvas.height, 0);
    pen.stroke();
  }
}
