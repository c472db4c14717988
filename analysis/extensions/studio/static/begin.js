// The page on which a design begins: the questions of init, a file of the folder, or an example.
import { $, act, ask, button, fill, follow, make, page, tell } from "./page.js";
import { picture } from "./paper.js";

const PAUSE = 250; // milliseconds without a key before a draft is asked for
const form = $("begin-form");
let questions = null; // as the studio asks them, and the name of the file
let isSent = false; // the form was sent, and its draft is awaited

export const begins = () => !$("begin").hidden;

// Show the page, unless nothing is installed that has the questions: then the example is shown.
export async function begin() {
  const { file, files, note, untouched } = page.state;
  if (!questions) {
    const found = await ask("/api/questions");
    if (found.missing) return void tell(`${note} No questions are asked: ${found.missing}`);
    $("questions").replaceChildren(...found.questions.map(group));
    questions = [...found.questions, { name: "name", label: "Name of the file", fields: [{}] }];
    // Answers of this tab outlive a page that is loaded again.
    Object.entries(JSON.parse(sessionStorage.getItem("answers") ?? "{}"))
      .filter(([name]) => form.elements[name])
      .forEach(([name, value]) => { form.elements[name].value = value; });
  }
  const others = files.filter((name) => name !== file);
  fill($("begin-files").lastElementChild, others.map((name) => make("li", {},
    button(name, async () => { if (await open(name)) close(page.state.note); }))));
  $("begin-example").hidden = !untouched;
  $("begin-back").hidden = untouched;
  let name = untouched ? file : "design.yaml";
  for (let k = 2; !untouched && [...files, file].includes(name); k += 1) name = `design-${k}.yaml`;
  $("begin-name").value = name;
  show(true);
  tell("");
  $("questions").querySelector("input:checked").focus();
  update(0);
}

function show(isShown) {
  $("begin").hidden = !isShown;
  $("design").hidden = isShown;
  page.show();
}

function close(said = "") {
  show(false);
  page.view.home();
  $("view").focus({ preventScroll: true });
  window.scrollTo(0, 0);
  tell(said);
}

// Leave the present design for another, once changes may be left; return whether that was done.
async function leave(action) {
  const { state: { file, saved, untouched }, typed } = page;
  const question = `${file} has changes that are not saved. Leave them?`;
  if ((typed || !(saved || untouched)) && !window.confirm(question)) return false;
  page.typed = false;
  $("planning").reset();
  return act({ ...action, discard: true });
}

export const open = (name) => leave({ do: "open", name });

async function begin_with(text, what) {
  const name = form.elements["answer-name-0"].value.trim();
  if (await leave({ do: "begin", name, text })) {
    close(`${name} is ${what}, and not saved yet; Save writes it`);
  }
}

function group({ name, label, hint, usual, fields }) {
  const made = fields.map((field, k) =>
    (field.choices ? choices : number)(field, `answer-${name}-${k}`));
  const box = make("fieldset", { id: `question-${name}` }, make("legend", {}, label),
    make("p", { class: "hint", id: `hint-${name}` }, hint, usual ? ` Empty: ${usual}.` : ""),
    make("div", { class: "fields" }, made),
    make("p", { class: "field-error", id: `error-${name}` }));
  box.querySelectorAll("input").forEach((one) =>
    one.setAttribute("aria-describedby", `hint-${name} error-${name}`));
  return box;
}

const number = ({ label, units }, id) => make("div", { class: "field" },
  make("label", { for: id }, label), make("div", { class: "bar" },
    make("input", { id, name: id, inputmode: "decimal", autocomplete: "off",
      pattern: "\\s*\\d*[.,]?\\d*\\s*" }),
    units.length < 2 ? make("span", {}, units[0].name)
      : make("select", { name: `${id}-unit`, "aria-label": `unit of ${label}` },
        units.map((unit, k) => make("option", { value: k }, unit.name)))));

// Choices, the first of them with pictures.
const choices = (field, name) => make("div", { class: "cards" },
  field.choices.map(({ value, words, shapes }) => make("label", { class: "card" },
    make("input", { type: "radio", name, value, checked: value === field.default }),
    shapes?.length ? [picture(shapes), make("strong", {}, value)] : null,
    make("span", {}, words))));

// The text of an answer as init takes it.
function answer({ name, fields }) {
  const inputs = fields.map((_, k) => form.elements[`answer-${name}-${k}`]);
  const isStated = inputs.some(({ value }, k) => fields[k].units && value.trim());
  return fields.map(({ units, usual }, k) => {
    const typed = inputs[k].value.trim();
    if (!units) return typed;
    const unit = units[form.elements[`answer-${name}-${k}-unit`]?.value ?? 0];
    // A constant that is stated alone does not grow.
    const empty = isStated && unit.text.includes("+") ? "" : unit.default;
    inputs[k].placeholder = empty ?? usual ?? "";
    const value = typed.replace(",", ".") || empty || "";
    return value && unit.text.replace("{}", () => value);
  }).join("");
}

function update(after) {
  sessionStorage.setItem("answers", JSON.stringify(Object.fromEntries(new FormData(form))));
  const answers = Object.fromEntries(questions.map((one) => [one.name, answer(one)]));
  follow("draft", answers, (draft) => {
    if (draft.error) return void tell(draft.error, true);
    messages(draft);
    if (draft.text) summary(draft, answers);
    $("draft").classList.toggle("earlier", !draft.text);
    if (isSent && form.reportValidity()) begin_with(draft.text, "a draft of your answers");
    isSent = false;
  }, after);
}

// What is wrong, which the browser shows once a field was left.
function messages(draft) {
  questions.forEach(({ name }) => {
    const inputs = [...$(`question-${name}`).querySelectorAll("input")];
    const wrong = inputs.find(({ validity }) => validity.patternMismatch);
    const message = wrong ? `"${wrong.value}" is no number` : draft.messages[name] ?? "";
    inputs.forEach((one) => one.setCustomValidity(wrong && one !== wrong ? "" : message));
    $(`error-${name}`).textContent = message;
  });
}

function summary(draft, answers) {
  const rows = questions.filter(({ name, usual }) => usual ?? draft.words[name])
    .map(({ label, name, usual }) => [make("dt", {}, label),
      make("dd", {}, draft.words[name] ?? (answers[name] || usual))]);
  $("draft").replaceChildren(make("h2", {}, "The draft"),
    picture(draft.shapes, "The volume with the plate where the design begins"),
    make("dl", {}, rows));
}

form.oninput = () => update(PAUSE);
form.onsubmit = (event) => {
  event.preventDefault();
  form.classList.add("sent");
  isSent = true;
  update(0);
};
$("begin-example").onclick = () => close(page.state.note);
$("begin-flat").onclick = async () => {
  const example = await fetch("/static/two-axes.yaml");
  await begin_with(await example.text(), "an example of two axes");
};
$("begin-back").onclick = () => close();
$("new").onclick = begin;
