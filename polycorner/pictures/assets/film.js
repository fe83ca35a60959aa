"use strict";

// Plays the film that the page carries: numbers packed in Python, unpacked here.

const $ = (id) => document.getElementById(id);
const WHOLE = 20; // seconds in which a film plays at speed 1
const MOST = 24; // contacts that are named
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10];

// Text in base64 of a gzip file, to its bytes.
async function unpacked(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

const floats = async (text) => new Float32Array(await unpacked(text));
const counts = async (text) => new Uint32Array(await unpacked(text));

async function decoded(data) {
  const film = { ...data, times: await floats(data.times), centres: await floats(data.centres) };
  if (data.roles) film.roles = new Uint8Array(await unpacked(data.roles));
  if (data.turns) film.turns = await floats(data.turns);
  film.energies = await Promise.all(data.energies.map(async ([name, text]) => [name, new Float64Array(await unpacked(text))]));
  film.word = await counts(data.word);
  film.places = await floats(data.contacts.places);
  film.which = await counts(data.contacts.which);
  film.first = await counts(data.contacts.first); // contacts of frame k: first[k] to first[k + 1]
  return film;
}

// Rows of the table beside the picture; returns their value cells.
function rows(names) {
  return names.map((name) => {
    const term = document.createElement("dt"), value = document.createElement("dd");
    term.textContent = name;
    $("readings").append(term, value);
    return value;
  });
}

function chips(value, names) {
  const list = document.createElement("ul");
  list.className = "chips";
  for (const name of names) list.append(Object.assign(document.createElement("li"), { textContent: name }));
  value.replaceChildren(names.length ? list : "none");
}

class Player {
  constructor(film, stage) {
    this.film = film;
    this.stage = stage;
    this.at = -1;
    const labels = [film.marks ?? "Contacts", ...film.labels, ...film.energies.map(([name]) => name)];
    const values = rows(labels);
    this.contacts = values[0];
    this.words = values.slice(1, 1 + film.labels.length);
    this.energies = values.slice(1 + film.labels.length);
    this.contacts.id = "contacts";
    this.hide(this.contacts, !film.contacts.names.length);
    this.words.forEach((value, k) => {
      value.id = film.labels[k].toLowerCase();
      this.hide(value, film.words.every((words) => !words[k])); // not recorded
    });
    this.energies.forEach((value, k) => { value.id = `energy-${k}`; });
    this.controls();
    this.look();
    this.show(0);
  }

  hide(value, unknown) {
    value.hidden = value.previousSibling.hidden = unknown;
  }

  controls() {
    const { times } = this.film, last = times.length - 1;
    $("timeline").hidden = $("following").hidden = last === 0;
    $("when").max = last;
    $("when").addEventListener("input", () => { this.pause(); this.show(Number($("when").value)); });
    $("play").addEventListener("click", () => this.playing ? this.pause() : this.play());
    $("back").addEventListener("click", () => this.step(-1));
    $("on").addEventListener("click", () => this.step(1));
    $("reset").addEventListener("click", () => this.look());
    $("follow").addEventListener("change", () => this.follow());
    // A speed that is asked for stands among factors of it, the whole film in WHOLE seconds else.
    const natural = this.film.speed ?? (times[last] - times[0]) / WHOLE;
    for (const speed of SPEEDS) {
      const real = this.film.unit === "s" ? ` (${Number((speed * natural).toPrecision(2))} × real time)` : "";
      $("speed").append(new Option(`${speed}×${real}`, speed, speed === 1, speed === 1));
    }
    this.rate = () => natural * Number($("speed").value);
    addEventListener("keydown", (event) => this.key(event));
  }

  key(event) {
    if (event.target.matches("input, select, button, .stage") && event.key !== " ") return;
    if (event.target.matches("select, button") || event.ctrlKey || event.metaKey || event.altKey) return;
    const act = {
      " ": () => this.playing ? this.pause() : this.play(),
      ArrowLeft: () => this.step(-1), ArrowRight: () => this.step(1),
      Home: () => this.step(-Infinity), End: () => this.step(Infinity),
    }[event.key];
    if (!act || this.film.times.length === 1) return;
    event.preventDefault();
    act();
  }

  // Frame the box of the film.
  look() {
    const { low, high } = this.film.box;
    const middle = low.map((value, k) => (value + high[k]) / 2);
    const across = 0.58 * Math.hypot(...low.map((value, k) => high[k] - value));
    this.stage.frame(middle, this.film.radius ?? Math.max(across, 1), this.film.from, this.film.up);
  }

  // Keep the bodies in the middle of the picture.
  follow() {
    if (!$("follow").checked) { this.middle = null; return; }
    const { film } = this, wide = film.centres.length / film.times.length, sum = [0, 0, 0];
    let found = 0;
    film.centres.subarray(this.at * wide, (this.at + 1) * wide).forEach((value, k) => {
      if (Number.isNaN(value)) return;
      sum[k % 3] += value;
      found += 1 / 3;
    });
    if (!found) return;
    const middle = sum.map((value) => value / found);
    if (this.middle) this.stage.shift(middle.map((value, k) => value - this.middle[k]));
    this.middle = middle;
  }

  play() {
    const { times } = this.film, last = times.length - 1;
    if (this.at === last) this.show(0);
    this.playing = true;
    $("play").textContent = "Pause";
    let clock = performance.now(), now = times[this.at];
    const frame = (stamp) => {
      if (!this.playing) return;
      now += (Math.max(0, stamp - clock) / 1000) * this.rate();
      clock = stamp;
      let next = this.at;
      while (next < last && times[next + 1] <= now) next += 1;
      this.show(next);
      if (next === last) this.pause();
      else requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  pause() {
    this.playing = false;
    $("play").textContent = "Play";
  }

  step(by) {
    this.pause();
    this.show(Math.min(Math.max(this.at + by, 0), this.film.times.length - 1));
  }

  show(k) {
    if (k === this.at) return;
    this.at = k;
    const { film } = this;
    this.stage.place(film, k);
    this.follow();
    const [from, to] = [film.first[k], film.first[k + 1]];
    const touching = Array.from({ length: to - from }, (_, j) => from + j);
    this.stage.contacts(touching.map((j) => [...film.places.subarray(3 * j, 3 * j + 3)]), film.mark);
    const names = [...new Set(touching.map((j) => film.contacts.names[film.which[j]]))];
    chips(this.contacts, names.length > MOST ? [`${touching.length} contacts`] : names);
    this.words.forEach((value, j) => { value.textContent = film.words[film.word[k]][j] || "not computed"; });
    film.energies.forEach(([, values], j) => { this.energies[j].textContent = values[k].toPrecision(7); });
    const time = film.unit === "" ? `${film.times[k]}` : `${film.times[k].toFixed(film.unit === "s" ? 2 : 3)} ${film.unit}`;
    $("clock").textContent = time;
    $("when").value = k;
    $("when").setAttribute("aria-valuetext", time);
  }
}

// A page without time: the model of an atlas with its legend.
async function showModel(data) {
  const stage = (window.stage = new Stage($("stage")));
  $("timeline").hidden = $("following").hidden = true;
  const box = await stage.model(await unpacked(data.model));
  if (box) stage.axes(["x", "y", "δ"], box.low, 10);
  const look = () => box && stage.frameBox(box);
  look();
  $("reset").addEventListener("click", look);
  data.legend.forEach(([title, entries], k) => {
    const [value] = rows([title]);
    chips(value, entries.map(([name]) => name));
    value.id = `legend-${k}`;
    entries.forEach(([, tone], j) => {
      const chip = value.querySelectorAll("li")[j];
      chip.className = "key";
      chip.style.setProperty("--tone", tone);
    });
  });
}

// What draws a film: bodies, or the stage of an application.
const STAGES = { bodies: Stage, ...(typeof DumbbellStage === "undefined" ? {} : { dumbbells: DumbbellStage }) };

async function begin() {
  const data = JSON.parse($("film").textContent);
  if (data.model) await showModel(data);
  else {
    const film = await decoded(data), stage = new STAGES[data.stage ?? "bodies"]($("stage"));
    await stage.build(film);
    window.player = new Player(film, stage);
  }
  document.documentElement.dataset.ready = "yes";
}

begin().catch((error) => {
  $("stage").textContent = `The page cannot be shown: ${error.message}`;
  throw error;
});
