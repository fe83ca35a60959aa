"use strict";

// The live page: sends slider values and names of buttons, shows what the library answers.
// Every number on the page is computed by the server.

const $ = (id) => document.getElementById(id);
const FALL = 3000; // ms that a fall takes on the page

class Board {
  constructor() {
    this.pending = {}; // values moved and not yet sent
    this.fields = {};
    this.stage = new DumbbellStage($("stage"));
    this.atlas = new Stage($("atlas"));
    this.socket = new WebSocket(`ws://${location.host}/live`);
    this.socket.binaryType = "arraybuffer";
    this.socket.addEventListener("message", ({ data }) => this.receive(data));
    this.socket.addEventListener("close", ({ reason }) => {
      this.closed = true;
      this.complain(`The connection is closed: ${reason || "the server has ended"}. Reload the page to go on.`);
    });
    $("reset").addEventListener("click", () => { this.look(); this.survey(); });
  }

  receive(data) {
    if (data instanceof ArrayBuffer) return void this.solid(data);
    const { kind, ...content } = JSON.parse(data);
    ({
      hello: () => this.build(content),
      reading: () => this.answered(content),
      fall: () => this.fall(content),
    })[kind]();
  }

  complain(words) {
    $("problem").textContent = words;
  }

  // ---------------------------------------------------------------------------------- what is sent

  build({ groups, buttons }) {
    for (const [legend, sliders] of groups) {
      const box = document.createElement("fieldset");
      box.append(Object.assign(document.createElement("legend"), { textContent: legend }));
      for (const slider of sliders) box.append(this.slider(slider));
      $("sliders").append(box);
    }
    for (const [name, label] of buttons) {
      const button = Object.assign(document.createElement("button"), { type: "button", id: name, textContent: label });
      button.className = name === "fall" ? "main" : "";
      button.addEventListener("click", () => this.push(name));
      $("buttons").append(button);
    }
  }

  slider({ name, label, low, high, step }) {
    const row = Object.assign(document.createElement("div"), { className: "slider" });
    const words = Object.assign(document.createElement("label"), { textContent: label, htmlFor: name });
    const range = Object.assign(document.createElement("input"), { id: name, type: "range", min: low, max: high, step });
    const field = Object.assign(document.createElement("input"), { type: "number", min: low, max: high, step: "any" });
    field.id = `${name}-number`;
    field.setAttribute("aria-label", label);
    range.addEventListener("input", () => { field.value = range.value; this.move(name, range.valueAsNumber); });
    field.addEventListener("input", () => {
      if (!field.checkValidity() || field.value === "") return;
      range.value = field.value;
      this.move(name, field.valueAsNumber);
    });
    this.fields[name] = { range, field };
    row.append(words, range, field);
    return row;
  }

  move(name, value) {
    this.stop();
    this.pending[name] = value;
    this.send();
  }

  push(name) {
    this.stop();
    this.send();
    if (!this.closed) this.socket.send(JSON.stringify(name));
  }

  // One message is under way at a time; values moved meanwhile go with the next one.
  send() {
    if (this.waiting || this.closed || !Object.keys(this.pending).length) return;
    this.waiting = performance.now();
    this.socket.send(JSON.stringify(this.pending));
    this.pending = {};
  }

  answered({ sliders, problem, ...reading }) {
    const moved = this.waiting;
    this.waiting = 0;
    this.complain(problem);
    this.settle(sliders);
    this.show(reading);
    if (moved) {
      const spent = performance.now() - moved;
      document.documentElement.dataset.latency = spent.toFixed(2);
      $("latency").textContent = `The last answer took ${spent.toFixed(1)} ms from slider to numbers.`;
    }
    this.send();
    document.documentElement.dataset.ready = "yes";
  }

  // Set the sliders to the server's values, except those moved since.
  settle(sliders) {
    for (const [name, value] of Object.entries(sliders)) {
      const { range, field } = this.fields[name];
      if (name in this.pending) continue;
      range.value = value;
      if (field !== document.activeElement) field.value = Number(value.toFixed(4));
    }
  }

  // --------------------------------------------------------------------------------- what is shown

  show(reading) {
    this.reading = reading;
    const first = this.sizes !== JSON.stringify(reading.sizes);
    this.sizes = JSON.stringify(reading.sizes);
    this.stage.wall(reading.wall);
    this.stage.dumbbells(reading.sizes, reading.centres, [0, 1]);
    this.stage.contacts(reading.contacts.map(([, place]) => place), reading.sizes.ball);
    if (first) this.look();
    this.gaps(reading.gaps, reading.contacts.map(([name]) => name));
    for (const name of ["contacts", "stratum", "chirality", "headings", "energy", "multipliers", "rest"]) {
      $(name).textContent = reading.words[name];
    }
    $("section").textContent = reading.words.section;
    this.track(reading.place);
  }

  gaps(gaps, closed) {
    const list = Object.entries(gaps).map(([name, value]) => {
      const item = document.createElement("li"), number = document.createElement("span");
      // A gap of a rounding error is closed, not an overlap.
      const state = closed.includes(name) ? "closed" : value < 0 ? "overlap" : "";
      item.id = `gap-${name}`;
      item.className = state;
      item.title = state ? `${name}: ${state}` : name;
      number.textContent = value.toFixed(4).replace(/^-(0\.0+)$/, "$1");
      item.append(state === "overlap" ? `${name} overlap` : name, number);
      return item;
    });
    $("gaps").replaceChildren(...list);
  }

  look() {
    const { low, high } = this.reading.box;
    const middle = low.map((value, k) => (value + high[k]) / 2);
    this.stage.frame(middle, 0.95 * (this.reading.sizes.length + 2 * this.reading.sizes.ball));
  }

  // ------------------------------------------------------------------------------------- the atlas

  async solid(buffer) {
    const box = await this.atlas.model(buffer);
    if (!box) return;
    const known = this.box;
    this.box = box;
    this.atlas.axes(["x", "y", "δ"], box.low, 10);
    if (!known || known.high.some((value, k) => Math.abs(value / box.high[k] - 1) > 0.2)) this.survey();
    document.documentElement.dataset.solid = "yes";
  }

  survey() {
    if (this.box) this.atlas.frameBox(this.box);
  }

  track(place) {
    this.atlas.way(this.trail ?? [], place, 0.25 * this.reading.sizes.ball);
  }

  // -------------------------------------------------------------------------------------- the fall

  fall({ frames, trail, verdict, way, last }) {
    this.complain("");
    $("verdict").textContent = "";
    $("way").textContent = way;
    this.trail = trail;
    const began = performance.now();
    const end = () => {
      this.falling = null;
      this.settle(last.sliders);
      this.show(last);
      $("verdict").textContent = verdict;
    };
    const frame = (now) => {
      if (this.falling !== frame) return; // something else was asked for meanwhile
      const share = (now - began) / FALL;
      if (share >= 1 || frames.length < 2) return void end();
      this.show(frames[Math.max(0, Math.floor(share * frames.length))]);
      requestAnimationFrame(frame);
    };
    this.falling = frame;
    requestAnimationFrame(frame);
  }

  stop() {
    this.falling = null;
    this.trail = [];
    $("verdict").textContent = "";
    $("way").textContent = "";
  }
}

window.board = new Board();
