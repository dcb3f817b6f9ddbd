"use strict";
const AT_ONCE = 30;
const SAID = { changed: "in both, and changed", left: "only in the left one", right: "only in the right one", same: "the same in both" };

start(async () => {
  const about = await pageHead("compare");
  const found = await ask("compare");
  const [left, right] = found.releases;
  byId("left").replaceChildren(...breakable(`${left.name}: ${left.where}`));
  byId("right").replaceChildren(...breakable(`${right.name}: ${right.where}`));
  byId("facts").textContent = Object.entries(found.counts).map(([name, count]) => `${count.toLocaleString("en")} ${SAID[name]}`).join(" · ");
  const names = [...new Set([...left.facts, ...right.facts].map(([name]) => name))];
  const value = (facts, name) => facts.find(([one]) => one === name)?.[1] ?? "–";
  byId("numbers").replaceChildren(...names.map((name) => {
    const [one, other] = [value(left.facts, name), value(right.facts, name)];
    return element("tr", { className: one === other ? "" : "differs" }, element("th", { textContent: name }), element("td", { textContent: one }), element("td", { textContent: other }));
  }));
  byId("where").append(...Object.entries(SAID).map(([name, said]) => element("option", { value: name, textContent: `${said} (${found.counts[name].toLocaleString("en")})` })));
  byId("where").value = words().where ?? Object.keys(SAID).find((name) => found.counts[name]) ?? "same";
  byId("text").value = words().text ?? "";
  document.documentElement.style.setProperty("--aspect", about.release.aspect.join(" / "));
  byId("filters").addEventListener("submit", (event) => event.preventDefault());
  byId("filters").addEventListener("input", soon(() => list(0)));
  await list(Number(words().offset ?? 0));
});

async function list(offset) {
  const state = { where: byId("where").value, text: byId("text").value.trim() };
  remember({ ...state, offset: offset || "" });
  try {
    const found = await ask("compare", { ...state, offset, limit: AT_ONCE });
    notice("");
    byId("count").textContent = plural(found.total, "clip");
    byId("pairs").replaceChildren(...found.clips.map((clip) => pair(clip, state.where)));
    pager(found.total, offset, AT_ONCE, async (to) => { await list(to); scrollTo(0, 0); });
  } catch (error) {
    notice(error.message);
  }
}

function pair(clip, where) {
  const side = (there, words) => there
    ? element("a", { className: "frame", href: address("/clip", { key: clip.key, ...words }) }, picture("thumbnail", { key: clip.key, ...words }, ""))
    : element("span", { className: "frame absent", textContent: "not in this one" });
  return element("article", {},
    element("h2", {}, ...breakable(clip.key)),
    clip.changed.length ? element("p", { className: "muted", textContent: clip.changed.join(", ") }) : null,
    element("div", { className: "pair" }, side(where !== "right", {}), side(where !== "left", { side: "other" })));
}
