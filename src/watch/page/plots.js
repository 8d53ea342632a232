// Plots of a quantity over the time of the episode, with the present moment.

// Margin for the axis labels, px.
const LEFT = 28, BOTTOM = 14;

export class Plot {
  // `options`: values (of a state, one per line), most (upper end of the axis at least), limit (a line to stay below),
  // is_d (the values are D/τ, on its logarithmic axis).
  constructor(canvas, options, seek) {
    this.canvas = canvas;
    this.options = options;
    this.span = 0;
    canvas.addEventListener("pointerdown", (event) => {
      const share = (event.offsetX - LEFT) / (canvas.clientWidth - LEFT);
      seek(Math.max(0, Math.min(1, share)) * this.span);
    });
  }

  // Draws the states up to now, with a mark at `cursor`. `span` is the number of control steps of the axis,
  // `d_axis` has the ends and ticks of that of D/τ.
  draw(states, cursor, span, hz, d_axis) {
    const { canvas, options } = this;
    this.span = span;
    const ratio = devicePixelRatio, width = canvas.clientWidth, height = canvas.clientHeight;
    if (canvas.width !== Math.round(width * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    const style = getComputedStyle(document.documentElement);
    const [ink, line, mute, harm] = ["--ink", "--line", "--mute", "--harm"].map((name) => style.getPropertyValue(name));
    const all = states.map((state) => options.values(state));
    const finite = all.flat().filter((value) => value !== null && value !== undefined);
    const most = options.fixed ? options.most : Math.max(options.most ?? 0, ...finite);
    const g = canvas.getContext("2d");
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    g.clearRect(0, 0, width, height);
    const x = (step) => LEFT + (step / span) * (width - LEFT - 2);
    const [from, to] = d_axis.ends;
    const share = (value) => options.is_d
      ? Math.log(Math.max(value, from) / from) / Math.log(to / from)
      : value / most;
    const y = (value) => height - BOTTOM - Math.min(share(value), 1) * (height - BOTTOM - 6);
    g.font = "11px system-ui, sans-serif";
    g.strokeStyle = line;
    g.fillStyle = mute;
    g.strokeRect(LEFT, 6, width - LEFT - 2, height - BOTTOM - 6);
    if (options.is_d) {
      for (const tick of d_axis.ticks.filter((tick) => tick !== options.limit)) g.fillText(String(tick), 2, y(tick) + 4);
    } else {
      g.fillText("0", LEFT - 12, height - BOTTOM);
      g.fillText(String(Number(most.toPrecision(2))), 2, 14);
    }
    g.fillText(`${(span / hz).toFixed(0)} s`, width - 26, height - 2);
    if (options.limit !== undefined) {
      g.strokeStyle = harm;
      g.setLineDash([4, 3]);
      g.beginPath();
      g.moveTo(LEFT, y(options.limit));
      g.lineTo(width - 2, y(options.limit));
      g.stroke();
      g.setLineDash([]);
      g.fillStyle = harm;
      g.fillText(String(options.limit), LEFT - 12, y(options.limit) + 4);
    }
    const lines = all.length ? all[0].length : 0;
    for (let k = 0; k < lines; k += 1) {
      g.strokeStyle = ink;
      g.globalAlpha = k === 0 ? 1 : 0.55;
      g.lineWidth = 1.5;
      g.beginPath();
      let is_open = false;
      all.forEach((values, step) => {
        const value = values[k];
        if (value === null || value === undefined) {
          is_open = false;
          return;
        }
        if (is_open) g.lineTo(x(step), y(value));
        else g.moveTo(x(step), y(value));
        is_open = true;
      });
      g.stroke();
      g.globalAlpha = 1;
      g.lineWidth = 1;
    }
    g.strokeStyle = "#2f6fde";
    g.beginPath();
    g.moveTo(x(cursor), 6);
    g.lineTo(x(cursor), height - BOTTOM);
    g.stroke();
  }
}
