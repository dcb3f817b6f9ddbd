"use strict";
const AT_ONCE = 50;

start(async () => {
  const about = await pageHead("source");
  const source = about.source;
  byId("facts").textContent = `${plural(source.containers, "container")}, read as ${source.dataset} (reader ${source.reader}): ${source.where}`;
  byId("text").value = words().text ?? "";
  byId("filters").addEventListener("submit", (event) => event.preventDefault());
  byId("filters").addEventListener("input", soon(() => list(0)));
  await list(Number(words().offset ?? 0));
});

async function list(offset) {
  const state = { text: byId("text").value.trim() };
  remember({ ...state, offset: offset || "" });
  try {
    const found = await ask("containers", { ...state, offset, limit: AT_ONCE });
    notice("");
    byId("count").textContent = plural(found.total, "container");
    byId("containers").replaceChildren(...found.containers.map(container));
    pager(found.total, offset, AT_ONCE, async (to) => { await list(to); scrollTo(0, 0); });
  } catch (error) {
    notice(error.message);
  }
}

function container(one) {
  const inside = element("div", {}, element("p", { className: "muted", textContent: "reading…" }));
  const box = element("details", { className: "container" }, element("summary", {}, ...breakable(one.id), " ", element("span", { className: "badge", textContent: one.layout })), inside);
  box.addEventListener("toggle", () => fill(one.id, inside).catch((error) => inside.replaceChildren(element("p", { className: "note", textContent: error.message }))), { once: true });
  return box;
}

async function fill(name, inside) {
  const found = await ask("container", { container: name });
  const cards = found.episodes.map((episode) => {
    const place = { container: name, key: episode.unit };
    const said = [`${episode.frames} frames`, episode.has_depth ? "" : "no depth", ...episode.notes].filter(Boolean).join(" · ");
    return element("a", { className: "card", href: address("/clip", place) },
      element("span", { className: "frame" }, picture("episode/thumbnail", place, "")),
      element("span", { className: "key-name" }, ...breakable(episode.unit)),
      element("span", { className: "muted", textContent: said }));
  });
  const refusals = found.refusals.map((one) => element("article", {},
    element("h2", {}, ...breakable(one.unit), " ", element("span", { className: "badge bad", textContent: one.reason })),
    element("p", { textContent: one.message })));
  const count = element("p", { className: "muted", textContent: `${plural(found.episodes.length, "usable trajectory", "usable trajectories")}, ${plural(found.refusals.length, "refusal")}` });
  inside.replaceChildren(count, element("div", { className: "cards" }, ...cards), ...refusals);
}
