/* SPDX-License-Identifier: MIT */
/* The part of a report that can be touched: time plots by dygraphs, two features against one
 * another, a selection that all share, findings on and off, downloads. */
(function() {
'use strict';
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
const features =
    [ {name : 'time', unit : 's', v : time} ].concat(D.features.map(f => ({...f, v : f32(f.v)})));
channels.forEach(c => {
  features.push({name : c.name + ' (measured)', unit : c.unit, v : c.z});
  features.push({name : c.name + ' (simulated)', unit : c.unit, v : c.m});
});
const section = document.getElementById('explore');
section.hidden = false;
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
const expected = D.kind === 'replay' ? 'expected' : 'simulated';
const withUnit = q => q.name + (q.unit ? ' (' + q.unit + ')' : '');
const fill = (select, list) => list.forEach((text, i) => select.add(new Option(text, i)));

fill(get('log'),
     D.logs.map(l => l.name).concat(D.logs.length > 1 ? [ 'all logs, one after another' ] : []));
fill(get('channel'), channels.map(withUnit));
get('log').value = state.log;
get('channel').value = state.channel;
fill(get('x'), features.map(withUnit));
fill(get('y'), features.map(withUnit));
const place = [ 'x', 'y' ].map(
    end => D.features.findIndex(f => new RegExp('(^|[^a-z])' + end + '$').test(f.name)));
get('x').value = place[0] >= 0 && place[1] >= 0 ? place[0] + 1 : Math.min(1, features.length - 1);
get('y').value = place[0] >= 0 && place[1] >= 0 ? place[1] + 1 : D.features.length + 1;

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
const active = i => {
  for (let f = 0; f < state.on.length; f++)
    if (state.on[f] && acts[i] >> f & 1)
      return f;
  return -1;
};
const inWindow = t => !state.window || (t >= state.window[0] && t <= state.window[1]);

let levels, residual, quiet = false, tableOf = () => 0;
const options = {
  legend : 'always',
  labelsSeparateLines : false,
  animatedZooms : false,
  connectSeparatedPoints : false,
valueFormatter: v => String(+v.toPrecision(6)),
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
    const [from, to] = rowsShown();
    const shade = (color, a, b) => {
      canvas.fillStyle = color;
      const x = g.toDomXCoord(tableOf(a));
      canvas.fillRect(x, area.y, Math.max(1, g.toDomXCoord(tableOf(b)) - x), area.h);
    };
    canvas.save();
    for (const which of [i => active(i), i => state.picked && state.picked[i] ? 99 : -1]) {
      for (let i = from; i < to;) {
        const f = which(i);
        let k = i + 1;
        while (k < to && which(k) === f)
          k++;
        canvas.globalAlpha = f === 99 ? 0.45 : 0.16;
        if (f >= 0)
          shade(f === 99 ? '#e0a800' : tint(f), i, k - 1);
        i = k;
      }
    }
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
function drawTime() {
  const c = channels[state.channel], [ from, to ] = rowsShown(), t = clock();
  tableOf = t;
  const a = [], b = [];
  for (let i = from; i < to; i++) {
    const last = c.after ? c.after[i] : c.m[i], half = c.sd ? 2 * c.sd[i] : 0;
    const own = c.after ? 0 : half;
    a.push([ t(i), [ c.z[i], c.z[i], c.z[i] ], [ c.m[i] - own, c.m[i], c.m[i] + own ] ].concat(
        c.after ? [ [ last - half, last, last + half ] ] : []));
    b.push([ t(i), c.z[i] - c.m[i] ].concat(c.after ? [ c.z[i] - last ] : []));
  }
  const names = [ 'time', 'measured', expected ], difference = 'measured - ' + expected;
  const colors = [ '--measured', '--before', '--after' ].map(style);
  const more = c.after ? [ 'extended' ] : [];
  [levels, residual].forEach(g => g && g.destroy());
  quiet = true;
  levels = new Dygraph(
      get('levels'), a,
      {...options, customBars : true, colors, labels : names.concat(more), ylabel : withUnit(c),
       labelsDiv : get('levels-legend')});
  residual = new Dygraph(get('residual'), b, {
    ...options,
    colors : colors.slice(1),
    ylabel : withUnit({name : 'residual', unit : c.unit}),
    labelsDiv : get('residual-legend'),
    labels : [ 'time', difference ].concat(c.after ? [ 'measured - extended' ] : [])
  });
  quiet = false;
  state.window = null;
}

// --- two features against one another, coloured by the residual
const canvas = get('map'), room = {
  left : 64,
  right : 12,
  top : 10,
  bottom : 40
};
let scale = null, drag = null;
const axes = () => ['x', 'y'].map(id => features[+get(id).value]);
function rangeOf(v, from, to) {
  let low = Infinity, high = -Infinity;
  for (let i = from; i < to; i++) {
    if (isFinite(v[i])) {
      low = Math.min(low, v[i]);
      high = Math.max(high, v[i]);
    }
  }
  const pad = (high - low || Math.abs(high) || 1) * 0.04;
  return [ low - pad, high + pad ];
}
function residualColor(r, most) {
  const s = Math.max(-1, Math.min(1, r / most)), end = s < 0 ? [ 0, 90, 200 ] : [ 230, 80, 0 ];
  return 'rgb(' + end.map(v => Math.round(140 + (v - 140) * Math.abs(s))).join(',') + ')';
}
function drawMap() {
  const width = canvas.clientWidth || 600, height = 360, ratio = window.devicePixelRatio || 1;
  canvas.width = width * ratio;
  canvas.height = height * ratio;
  const g = canvas.getContext('2d');
  g.scale(ratio, ratio);
  const [fx, fy] = axes(), c = channels[state.channel];
  const [from, to] = rowsShown(), t = clock();
  const X = rangeOf(fx.v, from, to), Y = rangeOf(fy.v, from, to);
  const x = v => room.left + (v - X[0]) / (X[1] - X[0]) * (width - room.left - room.right);
  const high = height - room.top - room.bottom;
  const y = v => height - room.bottom - (v - Y[0]) / (Y[1] - Y[0]) * high;
  scale = {X, Y, x, y, width, height};
  let most = 0;
  for (let i = from; i < to; i++)
    most += Math.abs(c.z[i] - c.m[i]);
  most = 3 * most / Math.max(1, to - from) || 1;
  g.font = '12px sans-serif';
  g.fillStyle = style('--ink');
  g.strokeStyle = 'rgba(128,128,128,.4)';
  for (let k = 0; k <= 4; k++) {
    const vx = X[0] + (X[1] - X[0]) * k / 4, vy = Y[0] + (Y[1] - Y[0]) * k / 4;
    g.textAlign = k === 4 ? 'right' : 'center';
    g.fillText(+vx.toPrecision(4), x(vx), height - room.bottom + 15);
    g.textAlign = 'right';
    g.fillText(+vy.toPrecision(4), room.left - 5, y(vy) + 4);
  }
  g.textAlign = 'center';
  g.fillText(withUnit(fx), width / 2, height - 6);
  g.save();
  g.translate(12, height / 2);
  g.rotate(-Math.PI / 2);
  g.fillText(withUnit(fy), 0, 0);
  g.restore();
  g.strokeRect(room.left, room.top, width - room.left - room.right, high);
  for (let i = from; i < to; i++) {
    if (!inWindow(t(i)))
      continue;
    const f = active(i), px = x(fx.v[i]), py = y(fy.v[i]);
    if (f >= 0) {
      g.fillStyle = tint(f);
      g.globalAlpha = 0.25;
      g.fillRect(px - 4, py - 4, 8, 8);
      g.globalAlpha = 1;
    }
    const picked = state.picked && state.picked[i];
    g.fillStyle = picked ? '#e0a800' : residualColor(c.z[i] - c.m[i], most);
    g.fillRect(px - 1.2, py - 1.2, 2.4, 2.4);
  }
  if (state.hover >= from && state.hover < to) {
    g.strokeStyle = style('--ink');
    g.beginPath();
    g.arc(x(fx.v[state.hover]), y(fy.v[state.hover]), 6, 0, 7);
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
function picture() { // the plots one above another, as a bitmap
  const from = [ 'levels', 'residual' ].map(id => get(id).querySelector('canvas')).concat(canvas);
  const out = document.createElement('canvas');
  out.width = Math.max(...from.map(c => c.width));
  out.height = from.reduce((h, c) => h + c.height, 0);
  const g = out.getContext('2d');
  g.fillStyle = style('--paper');
  g.fillRect(0, 0, out.width, out.height);
  let top = 0;
  from.forEach(c => {
    g.drawImage(c, 0, top);
    top += c.height;
  });
  return out;
}
function again() {
  drawTime();
  drawMap();
}
['log', 'channel'].forEach(id => get(id).addEventListener('change', () => {
  state[id] = +get(id).value;
  state.picked = null;
  get('picked').textContent = '';
  again();
}));
['x', 'y'].forEach(id => get(id).addEventListener('change', drawMap));
D.findings.forEach((f, i) => {
  const label = document.createElement('label'), box = document.createElement('input');
  box.type = 'checkbox';
  box.checked = true;
  box.id = 'explore-finding-' + f.number;
  box.addEventListener('change', () => {
    state.on[i] = box.checked;
    drawMap();
    [levels, residual].forEach(g => g.updateOptions({}));
  });
  label.style.borderLeft = '6px solid ' + tint(i);
  label.append(box, f.text);
  get('findings').append(label);
});
get('reset').addEventListener('click', () => {
  state.picked = null;
  get('picked').textContent = '';
  again();
});
get('rows').addEventListener('click', () => save('rows.csv', 'text/csv', csv()));
get('figure').addEventListener('click',
                               () => picture().toBlob(b => save('figure.png', 'image/png', b)));
window.addEventListener('resize', drawMap);
again();
window.rimExplore = {
  state,
  levels : () => levels,
  residual : () => residual,
  csv,
  picture,
  again
};
})();
