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
  for (const value of [record.t_s, record.state, record.level, record.kind, record.sentence]) {
    const td = document.createElement('td');
    td.textContent = shown(value);
    tr.append(td);
  }
  get('records').prepend(tr);
}
function take(record) {
  if (record.message) { // health, counters, a plan's entry
    get(record.message === 'entry' ? 'entry' : 'health').textContent =
        Object.entries(record).map(([ k, v ]) => k + ' ' + shown(v)).join(', ');
    return;
  }
  records.push(record);
  row(record);
  evidence.push([ records.length, record.ln_anom, record.threshold ]);
  get('standing').textContent = record.state === 'cleared' ? 'no alarm stands' : record.sentence;
  get('standing').className = 'verdict ' + (record.state === 'cleared' ? 'fine' : 'bad');
}
function draw() {
  get('count').textContent = records.length + ' records';
  if (typeof Dygraph === 'undefined' || !evidence.length)
    return;
  if (plot)
    plot.updateOptions({file : evidence});
  else
    plot = new Dygraph(get('plot'), evidence, {
      labels : [ 'record', 'ln anom', 'threshold' ],
      drawPoints : true,
      xlabel : 'record',
      ylabel : 'nats'
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
