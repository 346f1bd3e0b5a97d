/* SPDX-License-Identifier: MIT */
/* The page of `rim listen --html`: asks the program for what is new, and shows it. */
(function() {
'use strict';
const get = id => document.getElementById(id);
const records = [], evidence = [];
let asked = 0, plot = null;
const shown = v => v === null || v === undefined ? '' : String(v);

function row(record) {
  const tr = document.createElement('tr');
  const time = Number.isFinite(record.t_s) ? record.t_s.toFixed(2) : '';
  for (const value of [time, record.state, record.level, record.kind, record.sentence]) {
    const td = document.createElement('td');
    td.textContent = shown(value);
    tr.append(td);
  }
  get('records').prepend(tr);
}
// A message as words: "level OK, observations 1493", without what only programs need.
const words = m => Object.entries(m)
                       .filter(([ k ]) => !['message', 'model_id', 'sequence'].includes(k))
                       .map(([ k, v ]) => (k === 't_s' ? 't' : k.replaceAll('_', ' ')) + ' ' +
                                          shown(v) + (k === 't_s' ? ' s' : ''))
                       .join(', ');
function take(record) {
  if (record.message) { // health, counters, a plan's entry
    get(record.message === 'entry' ? 'entry' : 'health').textContent =
        record.message + ': ' + words(record);
    return;
  }
  const cleared = record.state === 'cleared';
  records.push(record);
  row(record);
  evidence.push([ records.length, record.ln_anom, record.threshold ]);
  get('standing').textContent = cleared ? '\u2713 no alarm stands' : '\u2717 an alarm stands';
  get('standing').className = 'verdict ' + (cleared ? 'fine' : 'bad');
  get('sentence').textContent = cleared ? '' : record.sentence;
}
const style = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
function draw() {
  get('count').textContent = records.length + (records.length === 1 ? ' record' : ' records');
  if (typeof Dygraph === 'undefined' || !evidence.length)
    return;
  if (plot)
    plot.updateOptions({file : evidence});
  else
    plot = new Dygraph(get('plot'), evidence, {
      labels : [ 'record', 'evidence', 'what raises an alarm' ],
      colors : [ style('--measured'), style('--warn') ],
      drawPoints : true,
      pointSize : 3,
      legend : 'always',
      labelsDiv : get('plot-legend'),
      xlabel : 'record',
      ylabel : 'evidence (nats)',
      rightGap : 12,
      xRangePad : 6,
      axes : {
        x : {axisLabelFormatter : v => Number.isInteger(v) ? String(v) : ''},
        y : {axisLabelWidth : 64}
      }
    });
}
async function ask() {
  try {
    const answer = await fetch('/records?from=' + asked);
    const news = await answer.json();
    get('link').textContent = 'live';
    asked += news.length;
    news.forEach(take);
    if (news.length)
      draw();
  } catch (reason) {
    get('link').textContent = 'rim listen has ended';
    return;
  }
  setTimeout(ask, 300);
}
ask();
window.rimLive = {records};
})();
