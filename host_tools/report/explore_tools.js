/* SPDX-License-Identifier: MIT */
/* What the plots of a report need beside a canvas: round numbers for axes, a small inverse, and a
 * pen that takes a canvas's commands and leaves SVG. */
const rimTools = (function() {
  'use strict';
  // Round numbers inside a range, some `about` of them.
  function ticks(range, about) {
    const raw = (range[1] - range[0]) / about, power = 10 ** Math.floor(Math.log10(raw));
    const step = [ 1, 2, 5, 10 ].find(m => m * power >= raw) * power, list = [];
    for (let k = Math.ceil(range[0] / step); k * step <= range[1] * (1 + 1e-12); k++)
      list.push(+(k * step).toPrecision(10));
    return list;
  }
  function inverse(m, n) { // Gauss and Jordan; n is 3 at most
    const a = m.slice(), b = a.map((v, k) => k % (n + 1) ? 0 : 1);
    for (let p = 0; p < n; p++) {
      const d = a[p * n + p];
      for (let k = 0; k < n; k++) {
        a[p * n + k] /= d;
        b[p * n + k] /= d;
      }
      for (let r = 0; r < n; r++) {
        const f = r === p ? 0 : a[r * n + p];
        for (let k = 0; k < n; k++) {
          a[r * n + k] -= f * a[p * n + k];
          b[r * n + k] -= f * b[p * n + k];
        }
      }
    }
    return b;
  }
  // What the plots above ask of a canvas, as elements of SVG.
  class Pen {
    constructor() {
      Object.assign(this, {
        parts : [],
        path : [],
        globalAlpha : 1,
        lineWidth : 1,
        textAlign : 'left',
        fillStyle : '#000',
        strokeStyle : '#000',
        font : '12px sans-serif',
        clips : 0,
        turn : ''
      });
    }
    put(text) { this.parts.push(text); }
    save() {
      this.kept = {turn : this.turn, open : this.open || 0};
      this.open = 0;
    }
    restore() {
      this.put('</g>'.repeat(this.open));
      this.turn = this.kept.turn;
      this.open = this.kept.open;
    }
    translate(x, y) { this.turn = `translate(${+ x.toFixed(1)} ${+ y.toFixed(1)})`; }
    rotate(angle) { this.turn += ` rotate(${+ (angle * 180 / Math.PI).toFixed(2)})`; }
    beginPath() { this.path = []; }
    moveTo(x, y) { this.path.push(`M${x.toFixed(1)} ${y.toFixed(1)}`); }
    lineTo(x, y) { this.path.push(`L${x.toFixed(1)} ${y.toFixed(1)}`); }
    rect(x, y, w, h) {
      this.moveTo(x, y);
      this.path.push(`h${w.toFixed(1)}v${h.toFixed(1)}h${(-w).toFixed(1)}z`);
    }
    fill() {
      this.put(`<path d="${this.path.join('')}" fill="${this.fillStyle}" fill-opacity="${
          this.globalAlpha}"/>`);
    }
    stroke() {
      this.put(`<path d="${this.path.join('')}" fill="none" stroke="${this.strokeStyle}" ` +
               `stroke-opacity="${this.globalAlpha}" stroke-width="${this.lineWidth}"/>`);
    }
    clip() {
      const id = 'clip' + ++Pen.clips;
      this.put(`<clipPath id="${id}"><path d="${
          this.path.join('')}"/></clipPath><g clip-path="url(#${id})">`);
      this.open++;
    }
    fillRect(x, y, w, h) {
      this.beginPath();
      this.rect(x, y, w, h);
      this.fill();
    }
    strokeRect(x, y, w, h) {
      this.beginPath();
      this.rect(x, y, w, h);
      this.stroke();
    }
    fillText(text, x, y) {
      const anchor = {left : 'start', right : 'end', center : 'middle'}[this.textAlign];
      const plain = String(text).replace(/&/g, '&amp;').replace(/</g, '&lt;');
      this.put(
          `<text x="${x.toFixed(1)}" y="${y.toFixed(1)}" text-anchor="${anchor}" font-size="12" ` +
          `fill="${this.fillStyle}"${this.turn ? ` transform="${this.turn}"` : ''}>${
              plain}</text>`);
    }
  }
  Pen.clips = 0;
  return {ticks, inverse, Pen};
})();
