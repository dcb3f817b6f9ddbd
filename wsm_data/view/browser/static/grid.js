"use strict";
const AT_ONCE = 60;
let columns = [];
let asked = null;

start(async () => {
  const about = await pageHead("grid");
  const release = about.release;
  columns = release.columns;
  byId("facts").textContent = `${plural(release.clips, "clip")}, ${plural(release.frames, "frame")}, ${release.codec}: ${release.where}`;
  if (release.notice) notice(release.notice);
  document.documentElement.style.setProperty("--aspect", release.aspect.join(" / "));
  buildFilters(release);
  for (const input of byId("filters").querySelectorAll("input, select")) input.addEventListener("input", soon(() => list(0)));
  byId("filters").addEventListener("submit", (event) => event.preventDefault());
  byId("clear").onclick = () => { byId("filters").reset(); list(0); };
  await list(Number(words().offset ?? 0));
});

function buildFilters(release) {
  const before = words();
  for (const column of columns.filter((one) => one.kind === "text" && one.values.length > 1)) {
    const options = column.values.map(([value, count]) => element("option", { value, textContent: `${value} (${count.toLocaleString("en")})` }));
    const select = element("select", { name: `is.${column.name}` }, element("option", { value: "", textContent: "all" }), ...options);
    byId("words").append(element("label", {}, `${column.name.replaceAll("_", " ")} `, select));
  }
  for (const column of columns.filter((one) => one.kind === "number" && one.least !== null)) {
    const field = (end, at) => element("input", { type: "number", step: "any", name: `${end}.${column.name}`, placeholder: number(at), ariaLabel: `${end} ${column.name}` });
    const label = `${column.name}${column.unit ? ` (${column.unit})` : ""}`;
    byId("limits").append(element("span", { title: column.summary }, label), field("min", column.least), "to", field("max", column.most));
  }
  byId("selection").append(element("option", { value: "", textContent: "none" }), ...release.selections.map((name) => element("option", { value: name, textContent: name })));
  byId("selection-label").hidden = !release.selections.length;
  const sorts = ["key", ...columns.map((one) => one.name), ...(release.selections.length ? ["rank"] : [])];
  byId("sort").append(...sorts.map((name) => element("option", { value: name, textContent: name.replaceAll("_", " ") })));
  for (const input of inputs()) if (input.name in before) input.type === "checkbox" ? (input.checked = before[input.name] === "1") : (input.value = before[input.name]);
  if (Object.keys(before).some((name) => /^(min|max)\./.test(name))) byId("ranges").open = true;
}

function inputs() {
  for (const name of ["text", "selection", "sort", "descending"]) byId(name).name = name;
  return byId("filters").querySelectorAll("input, select");
}

function state() {
  const found = {};
  for (const input of inputs()) {
    const value = input.type === "checkbox" ? (input.checked ? "1" : "") : input.value.trim();
    if (value !== "" && !(input.name === "sort" && value === "key")) found[input.name] = value;
  }
  if (found.sort === "rank" && !found.selection) delete found.sort;
  return found;
}

async function list(offset) {
  asked?.abort();
  asked = new AbortController();
  const query = state();
  const shown = { ...query, ...(offset ? { offset } : {}) };
  remember(shown);
  try {
    const found = await ask("clips", { ...query, offset, limit: AT_ONCE }, asked.signal);
    notice("");
    byId("count").textContent = plural(found.total, "clip");
    byId("clear").hidden = !Object.keys(query).length;
    byId("cards").replaceChildren(...found.clips.map((clip) => card(clip, query)));
    pager(found.total, offset, AT_ONCE, async (to) => { await list(to); scrollTo(0, 0); });
  } catch (error) {
    if (error.name !== "AbortError") notice(error.message);
  }
}

function card(clip, query) {
  const extra = [`${number(clip.frames - clip.padded_frames)} frames`];
  const sorted = columns.find((one) => one.kind === "number" && one.name === query.sort);
  if (sorted && sorted.name !== "frames") extra.push(`${sorted.name} ${number(clip[sorted.name])}${sorted.unit ? ` ${sorted.unit}` : ""}`);
  if (clip.rank) extra.push(`rank ${clip.rank}`);
  const badge = element("span", { className: "badge", textContent: clip.split });
  const text = element("span", { className: "key-name" }, ...breakable(clip.key));
  return element(
    "a",
    { className: "card", href: address("/clip", { ...query, key: clip.key }) },
    element("span", { className: "frame" }, picture("thumbnail", { key: clip.key }, "")),
    text,
    element("span", { className: "muted" }, badge, ` ${extra.join(" · ")}`),
    clip.why ? element("span", { className: "muted why", textContent: clip.why }) : null,
  );
}
