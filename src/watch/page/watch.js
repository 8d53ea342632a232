// The page: receives the feed, plays the states, and asks for episodes.
import { Plot } from "./plots.js";
import { readMessage } from "./message.js";
import { View } from "./scene.js";

const $ = (id) => document.getElementById(id);
const query = location.search;
const view = new View($("scene"));

// `cursor` is the state that is shown, in control steps with a fraction; `end` is the end message.
const player = { states: [], cursor: 0, playing: true, scene: null, end: null, last: performance.now() };
let menu = null;

function present() {
  return player.states[Math.min(Math.floor(player.cursor), player.states.length - 1)];
}

function seek(step) {
  player.cursor = Math.max(0, Math.min(step, player.states.length - 1));
  update();
}

function setPlaying(is_playing) {
  player.playing = is_playing;
  $("play").textContent = is_playing ? "❚❚" : "▶";
  $("play").setAttribute("aria-label", is_playing ? "Pause" : "Play");
}

const relative = (measured) => (measured.tau_pct ? [measured.d_pct / measured.tau_pct] : [null]);
const plots = [
  new Plot($("d-plot"), { values: (state) => relative(state.measured), is_d: true, limit: 1 }, seek),
  new Plot($("force-plot"), { values: (state) => state.measured.pad_force_n, most: 2 }, seek),
  new Plot($("width-plot"), { values: (state) => [state.measured.width_mm], most: 80, fixed: true }, seek),
];

function fixed(value, digits, unit = "") {
  return value === null || value === undefined ? "–" : value.toFixed(digits) + unit;
}

// Shows the verdict so far, or the final one.
function showBadge(measured) {
  const badge = $("badge"), is_last = player.end && Math.floor(player.cursor) >= player.states.length - 1;
  const peak = measured.peak_over_tau;
  const is_over = peak !== null && peak > 1;
  const word = !is_over ? "within τ" : measured.is_crushed ? "crushed" : "over the limit";
  let text = peak === null ? "no limit of D" : `${word} so far: peak D/τ ${peak.toFixed(2)}`;
  let is_harmed = is_over || !measured.no_drop;
  if (!measured.no_drop) text += ", dropped";
  if (is_last) {
    const verdict = player.end.verdict;
    is_harmed = !verdict.safety;
    text = `Goal ${verdict.goal ? "✓" : "✗"}  Safety ${verdict.safety ? "✓" : "✗"}`;
    if (peak !== null) text += `  peak D/τ ${peak.toFixed(2)}`;
    if (is_over && measured.is_crushed) text += "  crushed";
    if (!verdict.no_drop) text += "  dropped";
  }
  badge.hidden = false;
  badge.textContent = text;
  badge.className = is_harmed ? "harm" : "safe";
}

// Lists the parts of a goal of several parts: filled while they hold, half once they were met.
function showParts(parts) {
  const list = $("parts");
  list.hidden = parts.length === 0;
  list.replaceChildren(...parts.map((part) => {
    const item = document.createElement("li");
    const word = part.holds ? "holds" : part.met_s !== null ? `was met at ${part.met_s.toFixed(1)} s` : "not yet";
    const mark = part.holds ? "●" : part.met_s !== null ? "◐" : "○";
    item.textContent = `${mark} ${part.negated ? "must not be: " : ""}${part.name}, ${word}`;
    return item;
  }));
}

// Factor by which the motion of the markers is drawn.
const MAGNIFIED = 8;

// Draws the motion of the markers of a finger over its picture.
function drawMarkers(id, markers) {
  const canvas = $(`${id}-markers`), g = canvas.getContext("2d");
  g.clearRect(0, 0, canvas.width, canvas.height);
  if (!$("markers").checked) return;
  g.strokeStyle = g.fillStyle = "#ffffff";
  g.lineWidth = 1.5;
  for (let i = 0; i < markers.length; i += 4) {
    const [x0, y0, x1, y1] = markers.subarray(i, i + 4);
    g.fillRect(x0 - 1, y0 - 1, 2, 2);
    g.beginPath();
    g.moveTo(x0, y0);
    g.lineTo(x0 + MAGNIFIED * (x1 - x0), y0 + MAGNIFIED * (y1 - y0));
    g.stroke();
  }
}

function showPicture(id, bytes) {
  const image = $(id);
  const before = image.src;
  image.src = URL.createObjectURL(new Blob([bytes], { type: "image/jpeg" }));
  if (before.startsWith("blob:")) URL.revokeObjectURL(before);
}

// Shows the present state in every part of the page.
let shown = null;
function update() {
  const state = present();
  if (!state) return;
  const { measured } = state;
  if (state !== shown) {
    ["left", "right"].forEach((id, side) => showPicture(id, state.bytes(state.tactile[side].image)));
    shown = state;
  }
  ["left", "right"].forEach((id, side) => drawMarkers(id, state.floats(state.tactile[side].markers)));
  view.show(state);
  showBadge(measured);
  showParts(measured.goal_parts);
  const { control_hz: hz, d_axis } = player.scene, span = Math.max(player.states.length - 1, 10 * hz);
  const until = player.states.slice(0, Math.floor(player.cursor) + 1);
  plots.forEach((plot) => plot.draw(until, Math.floor(player.cursor), span, hz, d_axis));
  $("d-value").textContent = fixed(relative(measured)[0], 2);
  $("force-value").textContent = measured.pad_force_n.map((force) => force.toFixed(2)).join(" and ");
  $("width-value").textContent = measured.width_mm.toFixed(2);
  $("time").max = Math.max(0, player.states.length - 1);
  $("time").value = Math.floor(player.cursor);
  $("clock").textContent = `${measured.time_s.toFixed(2)} s, step ${Math.floor(player.cursor)} of ${player.states.length - 1}`;
  const rows = [
    ["grip ratio", fixed(measured.grip_ratio, 2)], ["slip", fixed(measured.slip_mm, 2, " mm")],
    ["collapsed volume, most", fixed(measured.collapsed_pct, 1, " %")], ["closure", fixed(measured.closure, 3)],
  ];
  $("numbers").replaceChildren(...rows.flatMap(([name, value]) => {
    const dt = document.createElement("dt"), dd = document.createElement("dd");
    dt.textContent = name;
    dd.textContent = value;
    return [dt, dd];
  }));
}

function fill(select, entries, selected) {
  select.replaceChildren(...entries.map(([value, text]) => new Option(text, value, false, String(value) === String(selected))));
}

// Shows what can be selected.
function openMenu(message) {
  menu = message;
  $("file").textContent = message.file;
  const { selected } = message;
  fill($("suite"), message.suites.map((suite) => [suite.name, suite.name]), selected.suite);
  fillTasks(selected.task);
  fill($("policy"), message.policies.map((name) => [name, name]), selected.policy);
  $("episode").value = selected.episode;
}

function fillTasks(selected) {
  const suite = menu.suites.find((one) => one.name === $("suite").value);
  fill($("task"), (suite?.tasks ?? []).map((task) => [task.id, `${task.id}: ${task.prompt}`]), selected);
}

function showError(text) {
  $("error").hidden = text === null;
  $("error").textContent = text ?? "";
}

// Takes in a message of the feed.
function receive(message) {
  switch (message.type) {
    case "open":
      openMenu(message);
      Object.assign(player, { states: [], cursor: 0, scene: null, end: null });
      shown = null;
      setPlaying(true);
      showError(null);
      $("badge").hidden = true;
      $("status").textContent = "building the scene";
      break;
    case "scene":
      player.scene = message;
      view.load(message);
      $("prompt").textContent = message.prompt;
      fill($("camera"), [["free", "free"], ["target", "follow the object"], ...message.cameras.map(({ name }) => [name, name])], $("camera").value);
      if (!$("camera").value) $("camera").value = "free";
      view.options.camera = $("camera").value;
      $("status").textContent = "simulating";
      break;
    case "state":
      player.states.push(message);
      if (player.states.length === 1) update();
      break;
    case "end":
      player.end = message;
      $("status").textContent = message.gave_up ? `the expert gave up: ${message.gave_up}` : `ended: ${message.outcome.kind}`;
      if (message.outcome.message) showError(message.outcome.message);
      break;
    case "error":
      showError(message.message);
      $("status").textContent = "error";
      break;
  }
  document.body.dataset.state = message.type;
}

// Asks for the selected episode.
async function select() {
  const content = {
    suite: $("suite").value, task: Number($("task").value), episode: Math.max(0, Number($("episode").value) || 0), policy: $("policy").value,
  };
  const answer = await fetch(`/select${query}`, { method: "POST", body: JSON.stringify(content) });
  if (!answer.ok) showError(await answer.text());
}

function connect() {
  const socket = new WebSocket(`ws://${location.host}/feed${query}`);
  socket.binaryType = "arraybuffer";
  socket.onmessage = (event) => receive(readMessage(event.data));
  socket.onclose = () => {
    $("status").textContent = "softvt watch has ended";
    document.body.dataset.state = "closed";
    setTimeout(connect, 2000);
  };
}

$("play").onclick = () => {
  const is_at_end = player.end && player.cursor >= player.states.length - 1;
  if (!player.playing && is_at_end) player.cursor = 0;
  setPlaying(!player.playing);
};
$("back").onclick = () => { setPlaying(false); seek(Math.floor(player.cursor) - 1); };
$("forward").onclick = () => { setPlaying(false); seek(Math.floor(player.cursor) + 1); };
$("time").oninput = () => { setPlaying(false); seek(Number($("time").value)); };
$("suite").onchange = () => { fillTasks(0); select(); };
for (const id of ["task", "episode", "policy"]) $(id).onchange = () => { $(id).blur(); select(); };
$("again").onclick = select;
for (const id of ["camera", "skin"]) {
  $(id).onchange = () => {
    const was_own = !["free", "target"].includes(view.options.camera);
    view.options[id] = $(id).value;
    if (id === "camera" && was_own) view.release();
    $("scale").hidden = view.options.skin !== "strain";
    update();
  };
}
$("markers").onchange = update;
for (const id of ["clear", "contacts", "commanded"]) $(id).onchange = () => { view.options[id] = $(id).checked; update(); };
addEventListener("keydown", (event) => {
  if (["INPUT", "SELECT", "BUTTON"].includes(event.target.tagName)) return;
  const button = { " ": "play", ArrowLeft: "back", ArrowRight: "forward" }[event.key];
  if (!button) return;
  event.preventDefault();
  $(button).click();
});

// Keys of teleoperation: the input that each adds to.
const KEYS = {
  w: ["x", 1], s: ["x", -1], a: ["y", 1], d: ["y", -1], r: ["z", 1], f: ["z", -1],
  q: ["turn", 1], e: ["turn", -1], c: ["close", 1], v: ["close", -1],
};
const pressed = new Set();
const isTeleop = () => menu?.selected.policy === "teleop" && !player.end;
addEventListener("keydown", (event) => {
  if (!isTeleop() || !KEYS[event.key.toLowerCase()] || event.ctrlKey || event.metaKey || event.target.tagName === "INPUT") return;
  // Letters would select an entry of a menu.
  event.preventDefault();
  pressed.add(event.key.toLowerCase());
});
addEventListener("keyup", (event) => pressed.delete(event.key.toLowerCase()));
addEventListener("blur", () => pressed.clear());

// Sticks at rest give small numbers.
const dead = (value) => (Math.abs(value) < 0.12 ? 0 : value);

// The input of keys and of the first gamepad: left stick along the table, right stick up and turn, triggers close and open.
function readInput() {
  const input = { x: 0, y: 0, z: 0, turn: 0, close: 0 };
  for (const key of pressed) input[KEYS[key][0]] += KEYS[key][1];
  const pad = [...(navigator.getGamepads?.() ?? [])].find((one) => one);
  if (pad) {
    input.x -= dead(pad.axes[1] ?? 0);
    input.y -= dead(pad.axes[0] ?? 0);
    input.z -= dead(pad.axes[3] ?? 0);
    input.turn -= dead(pad.axes[2] ?? 0);
    input.close += (pad.buttons[7]?.value ?? 0) - (pad.buttons[6]?.value ?? 0);
  }
  for (const name in input) input[name] = Math.max(-1, Math.min(1, input[name]));
  return input;
}

// Sends the input while there is any, and once when it ends.
let had_input = false;
setInterval(() => {
  $("keys").hidden = !isTeleop();
  if (!isTeleop()) return;
  const { x, y, z, turn, close } = readInput(), has_input = [x, y, z, turn, close].some((value) => value !== 0);
  if (has_input || had_input) {
    fetch(`/drive${query}`, { method: "POST", body: JSON.stringify({ translate: [x, y, z], turn, close }) });
  }
  had_input = has_input;
}, 50);

function animate(now) {
  const elapsed = Math.min(0.1, (now - player.last) / 1000);
  player.last = now;
  if (player.playing && player.states.length) {
    const before = Math.floor(player.cursor);
    const next = player.cursor + elapsed * Number($("speed").value) * player.scene.control_hz;
    player.cursor = isTeleop() ? player.states.length - 1 : Math.min(next, player.states.length - 1);
    if (Math.floor(player.cursor) !== before) update();
    if (player.end && player.cursor >= player.states.length - 1) {
      setPlaying(false);
      update();
    }
  }
  view.draw();
  requestAnimationFrame(animate);
}

connect();
requestAnimationFrame(animate);
