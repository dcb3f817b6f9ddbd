"use strict";
// What all pages share. Text of data goes in as text nodes alone, never as HTML.

const byId = (id) => document.getElementById(id);

function element(tag, properties = {}, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children.filter((one) => one !== null));
  return made;
}

const address = (path, words) => `${path}?${new URLSearchParams(words)}`;

async function ask(path, words = {}, signal = undefined) {
  const answer = await fetch(address(`/api/${path}`, words), { signal });
  const found = await answer.json().catch(() => ({ error: `${answer.status} ${answer.statusText}` }));
  if (!answer.ok) throw new Error(found.error);
  return found;
}

function notice(text) {
  byId("notice").textContent = text;
  byId("notice").hidden = !text;
}

// A name may break after / and _, so that a long one fits a phone.
function breakable(text) {
  return text.split(/(?<=[/_])/).flatMap((part, number) => (number ? [element("wbr"), part] : [part]));
}

const plural = (count, one, many = `${one}s`) => `${count.toLocaleString("en")} ${count === 1 ? one : many}`;

function number(value) {
  if (value === null || value === undefined) return "–";
  if (Number.isInteger(value)) return value.toLocaleString("en");
  const size = Math.abs(value);
  return size >= 100 ? value.toFixed(0) : size >= 10 ? value.toFixed(1) : size >= 0.095 ? value.toFixed(2) : value.toPrecision(2);
}

// A picture that says why it is not there.
function picture(path, words, alt) {
  const image = element("img", { src: address(`/api/${path}`, words), alt, loading: "lazy", decoding: "async" });
  image.addEventListener("error", async () => {
    const why = await ask(path, words).then(() => "no picture", (error) => error.message);
    image.replaceWith(element("span", { className: "no-picture", title: why }, why));
  }, { once: true });
  return image;
}

async function pageHead(page, title = null) {
  const about = await ask("about");
  byId("title").replaceChildren(...breakable(title ?? about.title));
  document.title = `${title ?? about.title}: ${page}`;
  const tabs = [
    ["grid", "clips", about.release],
    ["refused", `refused (${about.refusals})`, about.release || about.refusals],
    ["compare", "side by side", about.other],
    ["source", "source", about.source],
  ];
  byId("nav").replaceChildren(
    ...tabs.filter(([, , there]) => there).map(([name, label]) => {
      const link = element("a", { href: `/${name}`, textContent: label });
      if (name === page) link.setAttribute("aria-current", "page");
      return link;
    }),
  );
  return about;
}

// The state of a list stands in the address, so that "back" and a copied address give the same list again.
const words = () => Object.fromEntries(new URLSearchParams(location.search));

function remember(state) {
  const kept = Object.fromEntries(Object.entries(state).filter(([, value]) => value !== "" && value !== undefined));
  history.replaceState(null, "", Object.keys(kept).length ? address(location.pathname, kept) : location.pathname);
}

function pager(total, offset, limit, move) {
  byId("place").textContent = total ? `${(offset + 1).toLocaleString("en")} to ${Math.min(offset + limit, total).toLocaleString("en")} of ${total.toLocaleString("en")}` : "";
  byId("back").disabled = offset === 0;
  byId("forth").disabled = offset + limit >= total;
  byId("back").onclick = () => move(Math.max(0, offset - limit));
  byId("forth").onclick = () => move(offset + limit);
}

function soon(call, wait_ms = 150) {
  let timer;
  return () => {
    clearTimeout(timer);
    timer = setTimeout(call, wait_ms);
  };
}

function start(main) {
  main().catch((error) => notice(error.message));
}
