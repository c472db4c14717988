// The page on which a design begins: the questions of init, a file of the folder, or an example.
import { dialog } from "./computations.js";
import { $, act, ask, button, make, page, tell } from "./page.js";
import { picture } from "./paper.js";

const PAUSE = 250; // milliseconds without a key before a draft is asked for

let questions = null; // as the studio asks them, and the name of the file
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
    questions.push({ name: "name", label: "Name of the file", box: $("question-name"),
      read: () => [{ text: $("begin-name").value.trim(), fault: "" }] });
    questions.forEach(follow);
    restore();
  }
  const others = state.files.filter((name) => name !== state.file);
  $("begin-files").hidden = !others.length;
  $("begin-files").querySelector("ul").replaceChildren(...others.map((name) =>
    make("li", {}, button(name, async () => { if (await open(name)) close(page.state.note); }))));
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
  const { state, typed } = page;
  if (!typed && (state.saved || state.untouched)) return true;
  return dialog(`${state.file} has changes that are not saved. Leave them?`);
}

// Open another file of the folder, and return whether that was done.
export async function open(name) {
  if (!(await may_leave())) return false;
  page.typed = false;
  return act({ do: "open", name, discard: true });
}

async function begin_with(text, said) {
  const name = $("begin-name").value.trim();
  const action = { do: "begin", name, text, discard: true };
  if (!(await may_leave())) return;
  page.typed = false;
  if (await act(action)) close(`${name} ${said}; Save writes it`);
}

const controls = (box) => [...box.querySelectorAll("input, select")];
const property = (control) => (control.type === "radio" ? "checked" : "value");

// The fields of a question, which then has its `box` and `read`, each field's text and fault.
function group(question) {
  const { name, label, hint, usual } = question;
  const fields = question.fields.map((field, k) =>
    (field.choices ? choices : number)(field, `answer-${name}-${k}`));
  question.read = () => fields.map((field) => field.read());
  question.box = make("fieldset", { id: `question-${name}` }, make("legend", {}, label),
    make("p", { class: "hint", id: `hint-${name}` }, hint, usual ? ` Empty: ${usual}.` : ""),
    make("div", { class: "fields" }, fields.map((field) => field.element)),
    make("p", { class: "field-error", id: `error-${name}` }));
  controls(question.box).forEach((one) =>
    one.setAttribute("aria-describedby", `hint-${name} error-${name}`));
  return question.box;
}

function number({ label, units, usual }, id) {
  const input = make("input", { id, inputmode: "decimal", autocomplete: "off" });
  const select = make("select", { "aria-label": `unit of ${label}` },
    units.map((unit, k) => make("option", { value: k }, unit.name)));
  const unit = () => units[select.value || 0];
  select.oninput = () => { input.placeholder = unit().default ?? usual ?? ""; };
  select.oninput();
  const read = () => {
    const typed = input.value.trim().replace(",", ".");
    const value = typed || unit().default || "";
    return { input, text: value && unit().text.replace("{}", () => value),
      fault: Number(typed) >= 0 ? "" : `${label}: "${typed}" is no number` };
  };
  return { read, element: make("div", { class: "field" }, make("label", { for: id }, label),
    make("div", { class: "bar" }, input,
      units.length > 1 ? select : make("span", {}, unit().name))) };
}

// Choices with pictures first.
function choices(field, name) {
  const isDrawn = ({ shapes }) => shapes?.length > 0;
  const choice = (one) => make("label", { class: isDrawn(one) ? "card" : "" },
    make("input", { type: "radio", name, value: one.value, checked: one.value === field.default }),
    isDrawn(one) ? [picture(one.shapes), make("strong", {}, one.value)] : null,
    make("span", {}, one.words));
  const cards = field.choices.filter(isDrawn).map(choice);
  const others = make("div", { class: "choices" },
    field.choices.filter((one) => !isDrawn(one)).map(choice));
  return { read: () => ({ text: $("begin-form").elements[name].value, fault: "" }),
    element: cards.length ? make("div", {}, make("div", { class: "cards" }, cards),
      make("p", { class: "hint" }, "Or the order of the axes:"), others) : others };
}

// Answers of this tab outlive a page that is loaded again.
function restore() {
  const kept = JSON.parse(sessionStorage.getItem("answers") ?? "[]");
  controls($("questions")).forEach((one, k) => {
    one[property(one)] = kept[k] ?? one[property(one)];
    one.dispatchEvent(new Event("input"));
  });
}

// Follow what is typed, and report faults once its question is left.
function follow({ box, name }) {
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
  const answers = Object.fromEntries(questions.map((one) =>
    [one.name, one.read().map(({ text }) => text).join("")]));
  try {
    const found = await ask("/api/draft", answers);
    if (mine !== asked) return;
    draft = found;
    messages();
    if (draft.text) summary(answers);
    $("draft").classList.toggle("stale", !draft.text);
  } catch (error) {
    tell(error.message, true);
  }
}

// What is wrong at its field, but not while it is typed for the first time.
function messages() {
  const said = questions.flatMap(({ box, label, name, read }) => {
    const isTyped = box.contains(document.activeElement) && !left.has(name);
    const wrong = isTyped ? [] : read().filter(({ fault }) => fault);
    const message = isTyped ? ""
      : wrong.map(({ fault }) => fault).join("; ") || draft.messages[name] || "";
    $(`error-${name}`).textContent = message;
    controls(box).forEach((one) => one.setAttribute("aria-invalid", String(Boolean(message)
      && (!wrong.length || wrong.some(({ input }) => input === one)))));
    return message ? `${label}: ${message}` : [];
  });
  const status = said.join(". ");
  if ($("begin-status").textContent !== status) $("begin-status").textContent = status;
}

function summary(answers) {
  const rows = questions.filter(({ name, usual }) => usual ?? draft.words[name])
    .map(({ label, name, usual }) => [make("dt", {}, label),
      make("dd", {}, draft.words[name] ?? (answers[name] || usual))]);
  $("draft").replaceChildren(make("h2", {}, "The draft"),
    picture(draft.shapes, "The volume with the plate where the design begins"),
    make("dl", {}, ...rows.flat()));
}

async function make_design(event) {
  event.preventDefault();
  questions.forEach((one) => left.add(one.name));
  await update();
  if (draft?.text && !Object.keys(draft.messages).length) {
    await begin_with(draft.text, "is a draft of your answers, and not saved yet");
  } else $("begin").querySelector("[aria-invalid=true]")?.focus();
}

$("begin-form").addEventListener("submit", make_design);
$("begin-example").onclick = () => close(page.state.note);
$("begin-flat").onclick = async () => {
  const example = await fetch("/static/two-axes.yaml");
  await begin_with(await example.text(), "is an example of two axes, and not saved yet");
};
$("begin-back").onclick = () => close();
$("new").onclick = begin;
