/* SPDX-License-Identifier: MIT */
/* The part of a report that can be touched: time plots by dygraphs, two features against one
 * another, a selection that all share, findings on and off, downloads. */
(function() {
'use strict';
const {ticks, inverse, Pen} = rimTools;
const D = JSON.parse(document.getElementById('rim-data').textContent);
function bytes(text) {
  const raw = atob(text), all = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++)
    all[i] = raw.charCodeAt(i);
  return all.buffer;
}
const f32 = text => new Float32Array(bytes(text));
const time = f32(D.time), acts = new Uint16Array(bytes(D.acts));
const channels = D.channels.map(c => ({
                                  ...c,
                                  z : f32(c.z),
                                  m : f32(c.m),
                                  after : c.after && f32(c.after),
                                  sd : c.sd && f32(c.sd)
                                }));
const flight = D.kind === 'replay';
const expected = flight ? 'expected' : 'simulated';
const inkOfMean = flight ? '--after' : '--before'; // as in the pictures below
const features = [ {name : 'time', unit : 's', key : 't_s', v : time} ].concat(
    D.features.map(f => ({...f, v : f32(f.v)})));
channels.forEach(c => {
  features.push({name : c.name + ' (measured)', unit : c.unit, key : 'z.' + c.key, v : c.z});
  features.push(
      {name : c.name + ' (' + expected + ')', unit : c.unit, key : 'm.' + c.key, v : c.m});
});
const section = document.getElementById('explore');
section.hidden = false;
document.querySelectorAll('a[href="#explore"]').forEach(a => { a.hidden = false; });
const get = id => document.getElementById('explore-' + id);
const style = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const tints = [ '#cc79a7', '#e69f00', '#009e73', '#56b4e9', '#d55e00', '#0072b2', '#b8ab00' ];
const tint = i => tints[i % 7];
const state = {
  log : D.log,
  channel : D.channel,
  window : null,
  picked : null,
  hover : -1,
  on : D.findings.map(() => true)
};
const withUnit = q => q.name + (q.unit ? ' (' + q.unit + ')' : '');
const fill = (select, list) => list.forEach((text, i) => select.add(new Option(text, i)));

fill(get('log'),
     D.logs.map(l => l.name).concat(D.logs.length > 1 ? [ 'all logs, one after another' ] : []));
fill(get('channel'), channels.map(withUnit));
get('log').value = state.log;
get('channel').value = state.channel;
fill(get('x'), features.map(withUnit));
fill(get('y'), features.map(withUnit));
const indexOf = key => features.findIndex(f => f.key === key);
function showAxes(x, y) {
  get('x').value = x;
  get('y').value = y;
}
// Across and up for a finding: what its region names, else the feature over the outcome.
function axesOf(finding) {
  const named = finding.region ? finding.region.features.map(indexOf).filter(i => i >= 0) : [];
  const outcome = D.features.length + 1 + 2 * Math.max(0, finding.channel);
  return [ named.length ? named[0] : 0, named.length > 1 ? named[1] : outcome ];
}
// At first the path where there are positions, else the first region.
const place = [ 'x', 'y' ].map(
    end => D.features.findIndex(f => new RegExp('(^|[^a-z])' + end + '$').test(f.name)));
if (place[0] >= 0 && place[1] >= 0)
  showAxes(place[0] + 1, place[1] + 1);
else if (D.findings.length)
  showAxes(...axesOf(D.findings[0]));
else
  showAxes(Math.min(1, features.length - 1), D.features.length + 1);

function rowsShown() {
  const log = D.logs[state.log];
  return log ? [ log.first, log.first + log.rows ] : [ 0, time.length ];
}
// All logs stand one after another on one axis, with a gap between.
function clock() {
  if (D.logs[state.log])
    return i => time[i];
  const from = new Float64Array(time.length);
  let end = 0;
  D.logs.forEach(l => {
    for (let i = l.first; i < l.first + l.rows; i++)
      from[i] = end + time[i] - time[l.first];
    if (l.rows)
      end = from[l.first + l.rows - 1] * 1.02;
  });
  return i => from[i];
}
// A finding is of all logs, or of one; bit: its place in a row's word.
const ofLog = D.logs.map(
    (l, k) =>
        D.findings.map((f, i) => i).filter(i => D.findings[i].log < 0 || D.findings[i].log === k));
const logOf = new Uint16Array(time.length);
D.logs.forEach((l, k) => logOf.fill(k, l.first, l.first + l.rows));
// Of a diagnosis a finding is of one outcome; an alarm is of the whole vehicle.
const concerns = f =>
    flight || D.findings[f].channel < 0 || D.findings[f].channel === state.channel;
const active = i => {
  if (acts[i])
    for (const f of ofLog[logOf[i]])
      if (state.on[f] && concerns(f) && acts[i] >> D.findings[f].bit & 1)
        return f;
  return -1;
};
const shown = f => D.findings[f].log < 0 || !D.logs[state.log] || D.findings[f].log === state.log;
const inWindow = t => !state.window || (t >= state.window[0] && t <= state.window[1]);

let levels, residual, quiet = false, tableOf = () => 0;
// Where findings act, and the rows that are selected, as stripes from top to bottom.
function shadeTime(canvas, area, x) {
  const [from, to] = rowsShown();
  for (const which of [i => active(i), i => state.picked && state.picked[i] ? 99 : -1]) {
    for (let i = from; i < to;) {
      const f = which(i);
      let k = i + 1;
      while (k < to && which(k) === f)
        k++;
      if (f >= 0) {
        const left = Math.max(area.x, x(tableOf(i)));
        const right = Math.min(area.x + area.w, x(tableOf(k - 1)));
        canvas.globalAlpha = f === 99 ? 0.45 : 0.16;
        canvas.fillStyle = f === 99 ? '#e0a800' : tint(f);
        if (right >= left)
          canvas.fillRect(left, area.y, Math.max(1, right - left), area.h);
      }
      i = k;
    }
  }
  canvas.globalAlpha = 1;
}
// Two standard deviations about what is expected, one column of pixels at a time.
function drawBand(canvas, area, x, y) {
  const c = channels[state.channel], [ from, to ] = rowsShown(), mean = c.after || c.m;
  if (!c.sd || !(area.w > 0)) // not shown on paper
    return;
  const low = new Float64Array(Math.ceil(area.w) + 1).fill(Infinity);
  const high = low.map(() => -Infinity);
  for (let i = from; i < to; i++) {
    const p = Math.round(x(tableOf(i)) - area.x);
    if (p >= 0 && p < low.length && isFinite(mean[i])) {
      low[p] = Math.min(low[p], mean[i] - 2 * c.sd[i]);
      high[p] = Math.max(high[p], mean[i] + 2 * c.sd[i]);
    }
  }
  canvas.globalAlpha = 0.15;
  canvas.fillStyle = style(c.after ? '--after' : inkOfMean);
  canvas.beginPath();
  let wide = 1; // few rows: a column reaches to the next
  for (let p = low.length - 1, next = low.length; p >= 0; p--) {
    if (high[p] >= low[p]) {
      wide = Math.min(next - p, 60);
      canvas.rect(area.x + p, y(high[p]), wide, y(low[p]) - y(high[p]));
      next = p;
    }
  }
  canvas.fill();
  canvas.globalAlpha = 1;
}
const options = {
  legend : 'always',
  labelsSeparateLines : false,
  animatedZooms : false,
  connectSeparatedPoints : false,
  valueFormatter : v => String(+v.toPrecision(6)),
  xlabel : 'time (s)',
  highlightCircleSize : 4,
  rightGap : 12,
  axisLineColor : '#888',
  gridLineColor : 'rgba(128,128,128,.25)',
  xRangePad : 2,
  axes : {
    x : {axisLabelFormatter : v => String(+v.toPrecision(4))},
    y : {axisLabelWidth : 64, axisLabelFormatter : v => String(+v.toPrecision(4))}
  },
  underlayCallback : (canvas, area, g) => {
    canvas.save();
    shadeTime(canvas, area, t => g.toDomXCoord(t));
    if (g.graphDiv.parentNode === get('levels'))
      drawBand(canvas, area, t => g.toDomXCoord(t), v => g.toDomYCoord(v));
    canvas.restore();
  },
  drawCallback : (g, first) => {
    if (first || quiet)
      return;
    quiet = true;
    const range = g.xAxisRange();
    [levels, residual].forEach(o => {
      if (o && o !== g)
        o.updateOptions({dateWindow : range});
    });
    quiet = false;
    state.window = range;
    base = null;
    drawMap();
  },
  highlightCallback : (event, t, points, row) => {
    const other = event.currentTarget && levels.graphDiv.contains(event.target) ? residual : levels;
    if (other)
      other.setSelection(row);
    state.hover = rowsShown()[0] + row;
    drawMap();
  },
  unhighlightCallback : () => {
    [levels, residual].forEach(o => o && o.clearSelection());
    state.hover = -1;
    drawMap();
  },
};
// What the two plots over time show: names, colours, columns of values.
function series() {
  const c = channels[state.channel], ink = [ '--measured', inkOfMean, '--after' ].map(style);
  const more = c.after ? [ 'extended' ] : [];
  return {
    levels : {
      names : [ 'measured', expected ].concat(more),
      colors : ink,
      unit : withUnit(c),
      values : [ i => c.z[i], i => c.m[i] ].concat(c.after ? [ i => c.after[i] ] : [])
    },
    residual : {
      names : [ expected ].concat(more).map(n => 'measured \u2212 ' + n),
      colors : ink.slice(1),
      unit : withUnit({name : 'residual', unit : c.unit}),
      values : [ i => c.z[i] - c.m[i] ].concat(c.after ? [ i => c.z[i] - c.after[i] ] : [])
    }
  };
}
function drawTime() {
  const [from, to] = rowsShown(), t = clock(), all = series();
  tableOf = t;
  [levels, residual].forEach(g => g && g.destroy());
  levels = residual = null;
  const make = (id, s) => {
    const rows = [];
    for (let i = from; i < to; i++)
      rows.push([ t(i) ].concat(s.values.map(v => v(i))));
    return new Dygraph(get(id), rows, {
      ...options,
      colors : s.colors,
      ylabel : s.unit,
      labels : [ 'time' ].concat(s.names),
      labelsDiv : get(id + '-legend')
    });
  };
  quiet = true;
  levels = make('levels', all.levels);
  residual = make('residual', all.residual);
  quiet = false;
  state.window = null;
}

// --- two features against one another, coloured by the residual
const canvas = get('map'), room = {
  left : 64,
  right : 14,
  top : 34,
  bottom : 42
};
// scale: of the plot that is drawn; base: the plot without pointer and rectangle.
let scale = null, drag = null, base = null, regionsDrawn = 0;
const axes = () => ['x', 'y'].map(id => features[+get(id).value]);
function rangeOf(v, from, to) {
  let low = Infinity, high = -Infinity;
  for (let i = from; i < to; i++) {
    if (isFinite(v[i])) {
      low = Math.min(low, v[i]);
      high = Math.max(high, v[i]);
    }
  }
  if (!(high >= low))
    return [ 0, 1 ];
  const pad = (high - low || Math.abs(high) || 1) * 0.04;
  return [ low - pad, high + pad ];
}
const kShades = 10; // on each side of none
function shadeOf(r, most) { return Math.round(kShades * Math.max(-1, Math.min(1, r / most))); }
function shadeColor(shade) {
  const s = Math.abs(shade) / kShades, end = shade < 0 ? [ 0, 90, 200 ] : [ 230, 80, 0 ];
  return 'rgb(' + end.map(v => Math.round(150 + (v - 150) * Math.sqrt(s))).join(',') + ')';
}
// Both axes a length: one metre is as long across as up.
function fit(X, Y, width, fx, fy) {
  const across = width - room.left - room.right, dx = X[1] - X[0], dy = Y[1] - Y[0];
  if (fx.unit !== 'm' || fy.unit !== 'm')
    return {X, Y, height : 380};
  const up = Math.max(220, Math.min(560, across * dy / dx)), each = Math.max(dx / across, dy / up);
  const about = (r, length) => [(r[0] + r[1] - length) / 2, (r[0] + r[1] + length) / 2];
  return {
    X : about(X, each * across),
    Y : about(Y, each * up),
    height : Math.round(up + room.top + room.bottom)
  };
}
function scaleFor(width) {
  const [fx, fy] = axes(), [ from, to ] = rowsShown();
  const {X, Y, height} = fit(rangeOf(fx.v, from, to), rangeOf(fy.v, from, to), width, fx, fy);
  const across = width - room.left - room.right, up = height - room.top - room.bottom;
  return {
    X,
    Y,
    width,
    height,
    across,
    up,
    x : v => room.left + (v - X[0]) / (X[1] - X[0]) * across,
    y : v => room.top + up - (v - Y[0]) / (Y[1] - Y[0]) * up
  };
}
function drawAxes(g, s) {
  const [fx, fy] = axes();
  g.font = '12px sans-serif';
  g.strokeStyle = 'rgba(128,128,128,.25)';
  g.fillStyle = style('--ink2');
  const line = (x, y, x2, y2) => {
    g.beginPath();
    g.moveTo(x, y);
    g.lineTo(x2, y2);
    g.stroke();
  };
  g.textAlign = 'center';
  for (const v of ticks(s.X, Math.max(2, s.across / 110))) {
    line(s.x(v), room.top, s.x(v), room.top + s.up);
    g.fillText(String(v), s.x(v), room.top + s.up + 16);
  }
  g.textAlign = 'right';
  for (const v of ticks(s.Y, Math.max(2, s.up / 60))) {
    line(room.left, s.y(v), room.left + s.across, s.y(v));
    g.fillText(String(v), room.left - 6, s.y(v) + 4);
  }
  g.textAlign = 'center';
  g.fillText(withUnit(fx), room.left + s.across / 2, s.height - 8);
  g.save();
  g.translate(13, room.top + s.up / 2);
  g.rotate(-Math.PI / 2);
  g.fillText(withUnit(fy), 0, 0);
  g.restore();
  g.strokeStyle = 'rgba(128,128,128,.6)';
  g.strokeRect(room.left, room.top, s.across, s.up);
}
// What the colours mean.
function drawColors(g, s, most) {
  const c = channels[state.channel], wide = 9, left = s.width - room.right - 60 - wide * 21;
  const number = v => String(+v.toPrecision(2));
  for (let k = -kShades; k <= kShades; k++) {
    g.fillStyle = shadeColor(k);
    g.fillRect(left + (k + kShades) * wide, 8, wide, 10);
  }
  g.fillStyle = style('--ink2');
  g.textAlign = 'right';
  g.fillText('residual of ' + c.name + '   ' + number(-most), left - 6, 17);
  g.textAlign = 'left';
  g.fillText(number(most) + (c.unit ? ' ' + c.unit : ''), left + wide * 21 + 6, 17);
}
// Rows as squares of one size, those of a colour in one path.
function drawSquares(g, s, groups, half) {
  const [fx, fy] = axes();
  for (const [color, rows] of groups) {
    g.fillStyle = color;
    g.beginPath();
    for (const i of rows)
      g.rect(s.x(fx.v[i]) - half, s.y(fy.v[i]) - half, 2 * half, 2 * half);
    g.fill();
  }
}
// The shadow of an ellipsoid on two of its features is the ellipse of that part of its shape.
function ellipsePath(g, s, region, i, k) {
  const n = region.features.length, a = inverse(region.inverse_shape, n);
  const u = Math.sqrt(a[i * n + i]), w = a[i * n + k] / u;
  const v = Math.sqrt(Math.max(0, a[k * n + k] - w * w));
  for (let step = 0; step <= 72; step++) {
    const angle = step * Math.PI / 36, c = Math.cos(angle), d = Math.sin(angle);
    const x = s.x(region.center[i] + u * c), y = s.y(region.center[k] + w * c + v * d);
    if (step)
      g.lineTo(x, y);
    else
      g.moveTo(x, y);
  }
}
// From one bound to the other, or to the edge of the plot where there is none. An edge where the
// region is open has no line.
function boxPath(g, s, region, i, k, outline) {
  const end = (at, axis, side, edge) =>
      at < 0 || region.open[at][side] ? null : axis((side ? region.upper : region.lower)[at]);
  const left = end(i, s.x, 0), right = end(i, s.x, 1), low = end(k, s.y, 0), high = end(k, s.y, 1);
  const or = (v, other) => v === null ? other : v;
  const box = {
    l : or(left, room.left),
    r : or(right, room.left + s.across),
    b : or(low, room.top + s.up),
    t : or(high, room.top)
  };
  if (!outline) {
    g.rect(box.l, box.t, box.r - box.l, box.b - box.t);
    return;
  }
  const side = (shown, x, y, x2, y2) => {
    if (shown !== null) {
      g.moveTo(x, y);
      g.lineTo(x2, y2);
    }
  };
  side(left, box.l, box.t, box.l, box.b);
  side(right, box.r, box.t, box.r, box.b);
  side(low, box.l, box.b, box.r, box.b);
  side(high, box.l, box.t, box.r, box.t);
}
function drawRegions(g, s) {
  const [fx, fy] = axes();
  regionsDrawn = 0;
  g.save();
  g.beginPath();
  g.rect(room.left, room.top, s.across, s.up);
  g.clip();
  D.findings.forEach((finding, f) => {
    const region = finding.region;
    if (!region || !state.on[f] || !shown(f) || !concerns(f))
      return;
    const i = region.features.indexOf(fx.key), k = region.features.indexOf(fy.key);
    if ((i < 0 && k < 0) || i === k)
      return;
    regionsDrawn++;
    const round = region.ellipse && i >= 0 && k >= 0;
    for (const outline of [false, true]) {
      g.beginPath();
      if (round)
        ellipsePath(g, s, region, i, k);
      else
        boxPath(g, s, region, i, k, outline);
      g.globalAlpha = outline ? 1 : 0.1;
      g.fillStyle = g.strokeStyle = tint(f);
      g.lineWidth = 2;
      if (outline)
        g.stroke();
      else
        g.fill();
    }
  });
  g.lineWidth = 1;
  g.globalAlpha = 1;
  g.restore();
}
// Everything but the pointer, on a canvas or into a drawing.
function drawPlot(g, s) {
  const [from, to] = rowsShown(), t = clock(), c = channels[state.channel];
  let sum = 0, count = 0;
  for (let i = from; i < to; i++) {
    if (isFinite(c.z[i] - c.m[i])) {
      sum += Math.abs(c.z[i] - c.m[i]);
      count++;
    }
  }
  const most = 3 * sum / Math.max(1, count) || 1;
  drawAxes(g, s);
  drawColors(g, s, most);
  const halos = new Map(), dots = new Map();
  const put = (map, color, i) => (map.get(color) || map.set(color, []).get(color)).push(i);
  const [fx, fy] = axes();
  for (let i = from; i < to; i++) {
    if (!inWindow(t(i)) || !isFinite(fx.v[i]) || !isFinite(fy.v[i]))
      continue;
    const f = active(i);
    if (f >= 0)
      put(halos, tint(f), i);
    put(dots, state.picked && state.picked[i] ? '#e0a800' : shadeOf(c.z[i] - c.m[i], most), i);
  }
  g.globalAlpha = 0.2;
  drawSquares(g, s, halos, 5);
  g.globalAlpha = 1;
  const order = k => typeof k === 'string' ? 99 : Math.abs(k); // the farthest from none on top
  drawSquares(g, s,
              [...dots ]
                  .sort((a, b) => order(a[0]) - order(b[0]))
                  .map(([ k, rows ]) => [typeof k === 'string' ? k : shadeColor(k), rows]),
              1.6);
  drawRegions(g, s);
}
function drawMap() {
  const width = canvas.clientWidth || 600, ratio = window.devicePixelRatio || 1;
  if (!base || scale.width !== width) {
    scale = scaleFor(width);
    canvas.style.height = scale.height + 'px';
    canvas.width = width * ratio;
    canvas.height = scale.height * ratio;
    base = document.createElement('canvas');
    base.width = canvas.width;
    base.height = canvas.height;
    const g = base.getContext('2d');
    g.scale(ratio, ratio);
    drawPlot(g, scale);
  }
  const g = canvas.getContext('2d'), [ from, to ] = rowsShown(), [ fx, fy ] = axes();
  g.setTransform(1, 0, 0, 1, 0, 0);
  g.clearRect(0, 0, canvas.width, canvas.height);
  g.drawImage(base, 0, 0);
  g.scale(ratio, ratio);
  if (state.hover >= from && state.hover < to) {
    g.strokeStyle = style('--ink');
    g.lineWidth = 2;
    g.beginPath();
    g.arc(scale.x(fx.v[state.hover]), scale.y(fy.v[state.hover]), 7, 0, 7);
    g.stroke();
  }
  if (drag) {
    g.strokeStyle = '#e0a800';
    g.strokeRect(drag.x, drag.y, drag.toX - drag.x, drag.toY - drag.y);
  }
}
function pick() {
  const [fx, fy] = axes(), [ from, to ] = rowsShown();
  const inside = (v, a, b) => v >= Math.min(a, b) && v <= Math.max(a, b);
  let count = 0;
  state.picked = new Uint8Array(time.length);
  for (let i = from; i < to; i++) {
    if (inside(scale.x(fx.v[i]), drag.x, drag.toX) && inside(scale.y(fy.v[i]), drag.y, drag.toY)) {
      state.picked[i] = 1;
      count++;
    }
  }
  if (!count)
    state.picked = null;
  get('picked').textContent = count ? count + ' rows selected' : '';
}
const at = e => {
  const box = canvas.getBoundingClientRect();
  return [ e.clientX - box.left, e.clientY - box.top ];
};
canvas.addEventListener('mousedown', e => {
  const [x, y] = at(e);
  drag = {x, y, toX : x, toY : y};
});
canvas.addEventListener('mousemove', e => {
  const [x, y] = at(e);
  if (drag) {
    drag.toX = x;
    drag.toY = y;
    drawMap();
    return;
  }
  const [fx, fy] = axes(), [ from, to ] = rowsShown();
  let best = -1, least = 100;
  for (let i = from; i < to; i++) {
    const d = (scale.x(fx.v[i]) - x) ** 2 + (scale.y(fy.v[i]) - y) ** 2;
    if (d < least) {
      least = d;
      best = i;
    }
  }
  if (best < 0)
    return;
  const told = f => withUnit(f) + ' ' + +f.v[best].toPrecision(6);
  get('picked').textContent = [ fx, fy, features[0] ].map(told).join(', ');
  [levels, residual].forEach(g => g.setSelection(best - from));
});
window.addEventListener('mouseup', () => {
  if (!drag)
    return;
  pick();
  drag = null;
  base = null;
  drawMap();
  [levels, residual].forEach(g => g.updateOptions({}));
});

// --- choices and downloads
function save(name, type, data) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(new Blob([ data ], {type}));
  link.download = name;
  link.click();
}
function csv() {
  const c = channels[state.channel], [ from, to ] = rowsShown(), t = clock();
  const quoted = h => /[",]/.test(h) ? '"' + h.replace(/"/g, '""') + '"' : h;
  const lines =
      [ [ 't_s', 'measured', expected ]
            .concat(c.after ? [ 'extended' ] : [], [ 'finding' ], D.features.map(f => f.name))
            .map(quoted)
            .join(',') ];
  for (let i = from; i < to; i++) {
    if (!inWindow(t(i)) || (state.picked && !state.picked[i]))
      continue;
    const finding = active(i) < 0 ? 0 : D.findings[active(i)].number;
    lines.push([ t(i), c.z[i], c.m[i] ]
                   .concat(c.after ? [ c.after[i] ] : [], [ finding ],
                           D.features.map((f, k) => features[k + 1].v[i]))
                   .map(v => +v.toPrecision(7))
                   .join(','));
  }
  return lines.join('\n') + '\n';
}
// The plots one above another, as a bitmap.
function picture() {
  const from = [ 'levels', 'residual' ].map(id => get(id).querySelector('canvas')).concat(canvas);
  const out = document.createElement('canvas');
  out.width = Math.max(...from.map(c => c.width));
  out.height = from.reduce((h, c) => h + c.height, 0);
  const g = out.getContext('2d');
  g.fillStyle = style('--paper');
  g.fillRect(0, 0, out.width, out.height);
  let top = 0;
  from.forEach((c, k) => {
    g.drawImage(k < 2 ? c : base, 0, top);
    top += c.height;
  });
  return out;
}
// A plot over time: at most two points a pixel of each line.
function drawTimePlot(pen, s, range, width) {
  const [from, to] = rowsShown(), height = 250, t = tableOf;
  const area = {x : room.left, y : 28, w : width - room.left - room.right, h : height - 72};
  let low = Infinity, high = -Infinity;
  for (let i = from; i < to; i++) {
    for (const v of t(i) >= range[0] && t(i) <= range[1] ? s.values : []) {
      low = Math.min(low, v(i));
      high = Math.max(high, v(i));
    }
  }
  const pad = (high - low || 1) * 0.05, Y = [ low - pad, high + pad ];
  const x = v => area.x + (v - range[0]) / (range[1] - range[0]) * area.w;
  const y = v => area.y + area.h - (v - Y[0]) / (Y[1] - Y[0]) * area.h;
  pen.fillStyle = style('--ink2');
  pen.textAlign = 'center';
  ticks(range, 8).forEach(v => pen.fillText(v, x(v), area.y + area.h + 16));
  pen.fillText('time (s)', area.x + area.w / 2, area.y + area.h + 34);
  pen.textAlign = 'right';
  ticks(Y, 5).forEach(v => pen.fillText(v, area.x - 6, y(v) + 4));
  pen.textAlign = 'left';
  pen.fillText(s.unit, 4, 16);
  pen.strokeStyle = 'rgba(128,128,128,.6)';
  pen.strokeRect(area.x, area.y, area.w, area.h);
  pen.save();
  pen.beginPath();
  pen.rect(area.x, area.y, area.w, area.h);
  pen.clip();
  shadeTime(pen, area, x);
  if (s.names[0] === 'measured')
    drawBand(pen, area, x, y);
  s.values.forEach((v, n) => {
    pen.strokeStyle = s.colors[n];
    pen.beginPath();
    for (let i = from, pixel = -1, begun = false; i < to; pixel = -1) {
      let least = i, most = i;
      for (pixel = Math.round(x(t(i))); i < to && Math.round(x(t(i))) === pixel; i++) {
        least = v(i) < v(least) ? i : least;
        most = v(i) > v(most) ? i : most;
      }
      for (const k of [...new Set([ Math.min(least, most), Math.max(least, most) ])]) {
        if (isFinite(v(k)) && t(k) >= range[0] && t(k) <= range[1])
          pen[begun ? 'lineTo' : 'moveTo'](x(t(k)), y(v(k)));
        begun = isFinite(v(k)) && t(k) >= range[0] && t(k) <= range[1];
      }
    }
    pen.stroke();
    pen.fillStyle = s.colors[n];
    pen.textAlign = 'right';
  });
  pen.restore();
  s.names.forEach((name, n) => {
    pen.fillStyle = s.colors[n];
    pen.textAlign = 'right';
    pen.fillText(name, width - room.right - 130 * (s.names.length - 1 - n), 16);
  });
  return height;
}
// The same three plots as SVG: lines and shapes that can be edited and printed at any size.
function drawing() {
  const width = 1000, range = levels.xAxisRange(), all = series(), pen = new Pen();
  let top = 0, parts = [];
  const place = height => {
    parts.push(`<g transform="translate(0 ${top})">${pen.parts.join('\n')}</g>`);
    pen.parts = [];
    top += height;
  };
  place(drawTimePlot(pen, all.levels, range, width));
  place(drawTimePlot(pen, all.residual, range, width));
  const s = scaleFor(width);
  drawPlot(pen, s);
  place(s.height);
  return `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 ${width} ${top}" width="${width}" ` +
         `height="${top}" font-family="sans-serif"><rect width="100%" height="100%" ` +
         `fill="${style('--paper')}"/>${parts.join('')}</svg>\n`;
}
function again() {
  base = null;
  listFindings();
  drawTime();
  drawMap();
}
['log', 'channel'].forEach(id => get(id).addEventListener('change', () => {
  state[id] = +get(id).value;
  state.picked = null;
  get('picked').textContent = '';
  again();
}));
['x', 'y'].forEach(id => get(id).addEventListener('change', () => {
  base = null;
  drawMap();
}));
D.findings.forEach((f, i) => {
  const label = document.createElement('label'), box = document.createElement('input');
  box.type = 'checkbox';
  box.checked = true;
  box.id = 'explore-finding-' + i;
  box.addEventListener('change', () => {
    state.on[i] = box.checked;
    base = null;
    drawMap();
    [levels, residual].forEach(g => g.updateOptions({}));
  });
  label.style.borderLeft = '6px solid ' + tint(i);
  label.append(box, f.text);
  if (f.region && f.region.features.some(key => indexOf(key) >= 0)) {
    const button = document.createElement('button');
    button.type = 'button';
    button.textContent = 'its region';
    button.title = 'put what the region is of on the axes of the lower plot';
    button.addEventListener('click', event => {
      event.preventDefault();
      showAxes(...axesOf(f));
      if (!concerns(i)) {
        state.channel = f.channel;
        get('channel').value = f.channel;
      }
      again();
    });
    label.append(button);
  }
  get('findings').append(label);
});
function listFindings() {
  [...get('findings').children].forEach((label, i) => {
    label.hidden = !shown(i);
    label.classList.toggle('elsewhere', !concerns(i));
    label.title = concerns(i) ? '' : 'in another outcome than the one shown';
  });
}
get('reset').addEventListener('click', () => {
  state.picked = null;
  get('picked').textContent = '';
  again();
});
get('rows').addEventListener('click', () => save('rows.csv', 'text/csv', csv()));
get('figure').addEventListener('click',
                               () => picture().toBlob(b => save('figure.png', 'image/png', b)));
get('svg').addEventListener('click', () => save('figure.svg', 'image/svg+xml', drawing()));
window.addEventListener('resize', () => {
  base = null;
  drawMap();
});
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', again);
again();
window.rimExplore = {
  state,
  levels : () => levels,
  residual : () => residual,
  csv,
  picture,
  drawing,
  regionsDrawn : () => regionsDrawn,
  again
};
})();
