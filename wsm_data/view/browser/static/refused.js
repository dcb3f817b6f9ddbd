"use strict";
const AT_ONCE = 20;
let sourceIsThere = false;

start(async () => {
  const about = await pageHead("refused");
  sourceIsThere = Boolean(about.source);
  byId("facts").textContent = about.refusals
    ? `${plural(about.refusals, "refusal")} for ${plural(about.reasons.length, "reason")}${sourceIsThere ? "" : "; `wsm view RUN`, on the folder of the run, shows the frames too"}`
    : "nothing was refused";
  byId("reason").append(element("option", { value: "", textContent: "all" }), ...about.reasons.map(([name, count]) => element("option", { value: name, textContent: `${name} (${count.toLocaleString("en")})` })));
  byId("reason").value = words().reason ?? "";
  byId("text").value = words().text ?? "";
  byId("filters").addEventListener("submit", (event) => event.preventDefault());
  byId("filters").addEventListener("input", soon(() => list(0)));
  await list(Number(words().offset ?? 0));
});

async function list(offset) {
  const state = { reason: byId("reason").value, text: byId("text").value.trim() };
  remember({ ...state, offset: offset || "" });
  try {
    const found = await ask("refusals", { ...state, offset, limit: AT_ONCE });
    notice("");
    byId("count").textContent = plural(found.total, "refusal");
    byId("refusals").replaceChildren(...found.refusals.map(refusal));
    pager(found.total, offset, AT_ONCE, async (to) => { await list(to); scrollTo(0, 0); });
  } catch (error) {
    notice(error.message);
  }
}

function refusal(one) {
  const details = one.details && Object.keys(one.details).length
    ? element("details", {}, element("summary", { textContent: "measured" }), element("pre", { textContent: JSON.stringify(one.details, null, 2) }))
    : null;
  const where = [one.stage && `stage ${one.stage}`, one.source && `from ${one.source}`].filter(Boolean).join(", ");
  const article = element("article", {},
    element("h2", {}, ...breakable(one.unit), " ", element("span", { className: "badge bad", textContent: one.reason })),
    element("p", { className: "muted", textContent: where }),
    element("p", { textContent: one.message ?? "" }),
    details);
  if (sourceIsThere && (one.names_image || one.unit !== one.source)) article.append(framesButton(one));
  return article;
}

// Reading a frame may take a pass over an archive, so it is asked for.
function framesButton(one) {
  const label = one.names_image ? "show what is left of the image" : one.frame === null ? "show its first frame" : `show frame ${one.frame} and its neighbours`;
  const button = element("button", { type: "button", textContent: label });
  button.onclick = () => {
    if (one.names_image) {
      button.replaceWith(element("div", { className: "strip" }, element("figure", { className: "offending" }, picture("refusal/frame", { number: one.number, kind: "damaged" }, "the damaged image"), element("figcaption", { textContent: "as far as it can be decoded" }))));
      return;
    }
    const numbers = one.frame === null ? [0] : [one.frame - 1, one.frame, one.frame + 1].filter((number) => number >= 0);
    const figures = numbers.flatMap((frame) => ["rgb", "depth"].map((kind) => element("figure", frame === one.frame ? { className: "offending" } : {},
      picture("refusal/frame", { number: one.number, kind, frame }, `${kind} of frame ${frame}`),
      element("figcaption", { textContent: `${kind === "rgb" ? "colour" : "depth"}, frame ${frame}${frame === one.frame ? ": the one refused" : ""}` }))));
    button.replaceWith(element("div", { className: "strip" }, ...figures));
  };
  return button;
}
