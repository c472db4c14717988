// The page on which a design begins: the questions of init, a file of the folder, or an example.
import { dialog } from "./computations.js";
import { $, act, ask, make, page, tell } from "./page.js";
import { picture } from "./paper.js";

const PAUSE = 250; // milliseconds without a key before a draft is asked for

let questions = null; // as the studio asks them
let draft = null; // of the last answers
let asked = 0; // drafts that were asked for
let timer = null;
const left = new Set(); // the questions whose fields were left once

export const begins = () => !$("begin").hidden;

// Show the page, unless nothing is installed that has the questions: then the example is shown.
export async function begin() {
  const { state } = page;
  if (!questions) {
    const found = await ask("/api/questions");
    const note = `${state.note ? `${state.note}; ` : ""}no questions are asked: ${found.missing}`;
    if (found.missing) return void tell(note);
    ({ questions } = found);
    $("questions").replaceChildren(...questions.map(group));
    restore();
  }
  const others = state.files.filter((name) => name !== state.file);
  $("begin-files").hidden = !others.length;
  $("begin-files").querySelector("ul").replaceChildren(...others.map((name) =>
    make("li", {}, make("button", { onclick: () => open(name) }, name))));
  $("begin-example").hidden = !state.untouched;
  $("begin-back").hidden = state.untouched;
  let name = state.untouched ? state.file : "design.yaml";
  for (let k = 2; !state.untouched && state.files.concat(state.file).includes(name); k += 1) {
    name = `design-${k}.yaml`;
  }
  $("begin-name").value = name;
  show(true);
  tell("");
  $("questions").querySelector("input:checked").focus();
  update();
}

function show(isShown) {
  $("begin").hidden = !isShown;
  $("design").hidden = isShown;
  page.show();
}

function close(said = "") {
  show(false);
  page.view.resize();
  page.view.home();
  $("view").focus({ preventScroll: true });
  window.scrollTo(0, 0);
  tell(said);
}

// Ask whether changes of the present design may be left.
async function may_leave() {
  const { state } = page;
  if (state.saved || state.untouched) return true;
  return dialog(`${state.file} has changes that are not saved. Leave them?`, []);
}

async function open(name) {
  const action = { do: "open", name, discard: true };
  if (await may_leave() && await act(action)) close(page.state.note);
}

function group(question) {
  const { name } = question;
  const box = make("fieldset", { id: `question-${name}` },
    make("legend", {}, question.label),
    make("p", { class: "hint", id: `hint-${name}` }, question.hint,
      question.usual ? ` Empty: ${question.usual}.` : ""),
    make("div", { class: "fields" },
      ...question.fields.map((field, k) => (field.choices ? choices : number)(question, field, k))),
    make("p", { class: "field-error", id: `error-${name}` }));
  const described = `hint-${name} error-${name}`;
  controls(box).forEach((one) => one.setAttribute("aria-describedby", described));
  follow(box, name);
  return box;
}

const controls = (box) => [...box.querySelectorAll("input, select")];
const property = (control) => (control.type === "radio" ? "checked" : "value");

// Answers of this tab outlive a page that is loaded again.
function restore() {
  const kept = JSON.parse(sessionStorage.getItem("answers") ?? "[]");
  controls($("questions")).forEach((one, k) => {
    one[property(one)] = kept[k] ?? one[property(one)];
    one.dispatchEvent(new Event("input"));
  });
}

function number(question, field, k) {
  const id = `answer-${question.name}-${k}`;
  const input = make("input", { id, inputmode: "decimal", autocomplete: "off" });
  const units = make("select", { "aria-label": `unit of ${field.label}` },
    ...field.units.map((unit, number) => make("option", { value: number }, unit.name)));
  const hint = () => {
    const { default: usual } = field.units[units.value || 0];
    input.placeholder = usual ?? field.usual ?? "";
  };
  units.addEventListener("input", hint);
  hint();
  return make("div", { class: "field" }, make("label", { for: id }, field.label),
    make("div", { class: "bar" }, input,
      field.units.length > 1 ? units : make("span", {}, field.units[0].name)));
}

// Choices with pictures first; where there are any, those without are folded.
function choices(question, field, k) {
  const isDrawn = ({ shapes }) => shapes?.length > 0;
  const choice = (one) => make("label", { class: isDrawn(one) ? "card" : "" },
    make("input", { type: "radio", name: `answer-${question.name}-${k}`, value: one.value,
      checked: one.value === field.default }),
    ...(isDrawn(one) ? [picture(one.shapes), make("strong", {}, one.value)] : []),
    make("span", {}, one.words));
  const drawn = field.choices.filter(isDrawn);
  const others = field.choices.filter((one) => !isDrawn(one)).map(choice);
  if (!drawn.length) return make("div", { class: "choices" }, ...others);
  return make("div", {}, make("div", { class: "cards" }, ...drawn.map(choice)),
    make("details", {}, make("summary", {}, "another chain of axes"),
      make("div", { class: "choices" }, ...others)));
}

// The text of an entry as init takes it, and whether it was stated.
function entry(question) {
  let isStated = false;
  const texts = question.fields.map((field, k) => {
    const id = `answer-${question.name}-${k}`;
    const typed = field.choices ? $("begin-form").elements[id].value : $(id).value.trim();
    if (typed) isStated = true;
    if (field.choices) return typed;
    const unit = field.units[$(id).parentElement.querySelector("select")?.value ?? 0];
    const value = typed || unit.default || "";
    return value && unit.text.replace("{}", () => value);
  });
  return { text: texts.join(""), isStated };
}

// Follow what is typed, and report faults once its question is left.
function follow(box, name) {
  box.addEventListener("input", () => {
    clearTimeout(timer);
    timer = setTimeout(update, PAUSE);
  });
  box.addEventListener("focusout", (event) => {
    if (box.contains(event.relatedTarget)) return;
    left.add(name);
    if (draft) messages();
  });
}

async function update() {
  clearTimeout(timer);
  asked += 1;
  const mine = asked;
  const kept = controls($("questions")).map((one) => one[property(one)]);
  sessionStorage.setItem("answers", JSON.stringify(kept));
  const answers = Object.fromEntries(questions.map((one) => [one.name, entry(one).text]));
  try {
    const found = await ask("/api/draft", { ...answers, name: $("begin-name").value.trim() });
    if (mine !== asked) return;
    draft = found;
    messages();
    if (draft.text) summary();
    $("draft").classList.toggle("stale", !draft.text);
  } catch (error) {
    tell(error.message, true);
  }
}

// What is wrong at its field, but not while it is typed for the first time.
function messages() {
  const said = [];
  for (const { name, label } of [...questions, { name: "name", label: "Name of the file" }]) {
    const box = $(`question-${name}`);
    const isTyped = box.contains(document.activeElement) && !left.has(name);
    const message = (!isTyped && draft.messages[name]) || "";
    $(`error-${name}`).textContent = message;
    controls(box).forEach((one) => one.setAttribute("aria-invalid", String(!!message)));
    if (message) said.push(`${label}: ${message}`);
  }
  const status = said.join(". ");
  if ($("begin-status").textContent !== status) $("begin-status").textContent = status;
}

function summary() {
  const rows = questions.flatMap((question) => {
    const usual = entry(question).isStated ? "" : question.usual ?? "as shown in grey";
    const words = draft.words[question.name];
    if (!words && !question.usual) return [];
    return [make("dt", {}, question.label), make("dd", {}, words ?? (usual || entry(question).text),
      words && usual ? make("small", {}, ` (${usual})`) : null)];
  });
  $("draft").replaceChildren(make("h2", {}, "The draft"),
    picture(draft.shapes, "The volume with the plate where the design begins"),
    make("dl", {}, ...rows));
}

async function make_design(event) {
  event.preventDefault();
  questions.forEach((one) => left.add(one.name));
  left.add("name");
  await update();
  if (!draft?.text || Object.keys(draft.messages).length) {
    $("begin").querySelector("[aria-invalid=true]")?.focus();
    return;
  }
  const name = $("begin-name").value.trim();
  const action = { do: "begin", name, text: draft.text, discard: true };
  if (await may_leave() && await act(action)) {
    close(`${name} is a draft of your answers, and not saved yet; Save writes it`);
  }
}

$("begin-form").addEventListener("submit", make_design);
follow($("question-name"), "name");
$("begin-example").onclick = () => close(page.state.note);
$("begin-back").onclick = () => close();
$("new").onclick = begin;
