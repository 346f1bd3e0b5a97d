#!/bin/bash
# SPDX-License-Identifier: MIT
# report.html in a real headless browser: the sentence and every finding are on the page, what can be
# touched shows the right numbers, nothing is fetched, no script is needed, no text covers another or leaves its picture, the page is not blank.
# Skipped, saying so, where no browser is installed.
# Mostly waits.
. "$(dirname "$0")/check.inc"
. "$(dirname "$0")/toy.inc"
cd "$here" || exit 1
sample=$BUILD/tests/host/test_diagnose_outputs
for browser in chromium-headless-shell chromium chromium-browser google-chrome; do
  command -v "$browser" > /dev/null && break
  browser=
done
[ -n "$browser" ] || skip "no browser (Debian: chromium-headless-shell)"
[ "$browser" = chromium-headless-shell ] || browser="$browser --headless"

# browse WIDTH,HEIGHT PAGE OPTION...: stdout is the browser's, its messages are in browser.log.
browse() {
  local size=$1 page=$2
  shift 2
  timeout 120 $browser --no-sandbox --disable-gpu --no-first-run --disable-background-networking \
    --disable-component-update --hide-scrollbars --user-data-dir="$here/profile" \
    --enable-logging=stderr --virtual-time-budget=3000 --window-size="$size" "$@" \
    "file://$here/$page" 2> browser.log
}
console() { grep -c 'CONSOLE' browser.log; }
# Requests that the page made. A full browser also makes its own (the time, its updates), which the
# net log marks as from no page.
fetched() {
  grep '"initiator":' net.json | grep -v '"initiator":"not an origin"' |
    grep -c -v -e '"url":"file:' -e '"url":"data:' -e '"url":"chrome'
}

# Appended to a copy of a page, it writes what it measured into the page's title: pairs of texts of
# a picture that cover one another, texts outside their picture, pixels of the page beyond the
# window, pictures.
cat > measure.html <<'EOF'
<script>
let covered = 0, outside = 0, pictures = 0;
for (const svg of document.querySelectorAll('svg[role=img]')) {
  pictures++;
  const frame = svg.getBoundingClientRect();
  const boxes = [...svg.querySelectorAll('text')].map(t => t.getBoundingClientRect());
  boxes.forEach((a, i) => {
    if (a.left < frame.left - 1 || a.right > frame.right + 1 || a.top < frame.top - 3 ||
        a.bottom > frame.bottom + 3) outside++;
    for (const b of boxes.slice(i + 1))
      if (Math.min(a.right, b.right) - Math.max(a.left, b.left) > 1 &&
          Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 3) covered++;
  });
}
const wide = Math.max(0, document.documentElement.scrollWidth - window.innerWidth);
document.title = `measured covered=${covered} outside=${outside} wide=${wide} pictures=${pictures}`;
</script>
EOF
# measure PAGE SIZE OPTION...: that title; the page as it was then is in dom.html
measure() {
  cat "$1" measure.html > measured.html
  browse "$2" measured.html --dump-dom "${@:3}" > dom.html
  grep -o '<title>measured [^<]*' dom.html | cut -c8-
}

# The checks themselves can fail: a page with every fault.
cat > faulty.html <<'EOF'
<!DOCTYPE html><title>faulty</title><img src="http://127.0.0.1:9/x.png"><script>console.error("no")</script>
<svg role="img" width="100" height="40" style="width:2000px"><text x="0" y="20">one</text><text x="2" y="20">two</text></svg>
EOF
seen=$(measure faulty.html 800,600 --log-net-log="$here/net.json" --screenshot="$here/faulty.png")
[ "$(console)" -ge 1 ]; check "a console error is seen" 0 $?
[ "$(fetched)" -ge 1 ]; check "a request is seen" 0 $?
contains "covered text is seen" "$seen" "covered=1 .* wide=[1-9]"
echo '<!DOCTYPE html><title>blank</title>' > blank.html
browse 1200,1600 blank.html --dump-dom --log-net-log="$here/net.json" --screenshot="$here/blank.png" > /dev/null
blank=$(stat -c %s blank.png)
check "a blank page makes no request" 0 "$(fetched)"

# page NAME FILE: what holds for every report, by two starts of the browser, which cost most of this script; the wider
# page, in dom.html, is the last
page() {
  local name=$1 file=$2 seen
  seen=$(measure "$file" 420,900)
  contains "$name: on a telephone" "$seen" 'covered=0 outside=0 wide=0'
  rm -f net.json seen.png
  seen=$(measure "$file" 1200,1600 --log-net-log="$here/net.json" --screenshot="$here/seen.png")
  contains "$name: on a desk" "$seen" 'covered=0 outside=0 wide=0 pictures=[1-9]'
  [ -s net.json ]; check "$name: rendered" 0 $?
  check "$name: nothing on the console" 0 "$(console)"
  check "$name: nothing fetched" 0 "$(fetched)"
  check "$name: no script from elsewhere" 0 "$(grep -c '<script[^>]*src' dom.html)"
  [ "$(stat -c %s seen.png)" -gt $((5 * blank)) ]; check "$name: not blank" 0 $?
  [ "$(stat -c %s "$file")" -lt 5000000 ]; check "$name: under 5 MB" 0 $?
}
# Appended to a copy of a page: the pointer over a row of the upper plot, a zoom, a rectangle in the
# lower one, a finding switched off; what the page then shows goes into its title.
cat > touch.html <<'EOF'
<script>
{
const E = rimExplore, g = E.levels(), row = 700;
const box = g.graphDiv.getBoundingClientRect();
const [x, y] = g.toDomCoords(g.getValue(row, 0), g.getValue(row, 1));
const move = (element, type, x, y) => element.dispatchEvent(
  new MouseEvent(type, {clientX: x, clientY: y, bubbles: true, cancelable: true, view: window}));
move(g.mouseEventElement_, 'mousemove', box.left + x, box.top + y);
const legend = document.getElementById('explore-levels-legend').textContent.replace(/\s+/g, ' ');
const both = E.residual().getSelection();
g.updateOptions({dateWindow: [20, 40]});
const linked = E.residual().xAxisRange().join('-');
const lines = E.csv().trim().split('\n').length;
E.again();
const map = document.getElementById('explore-map'), at = map.getBoundingClientRect();
move(map, 'mousedown', at.left, at.top); move(map, 'mousemove', at.right, at.bottom);
move(map, 'mouseup', at.right, at.bottom);
const picked = document.getElementById('explore-picked').textContent;
const first = document.querySelector('#explore-findings input');
const inside = () => {
  const [head, ...rows] = E.csv().split('\n'), at = head.split(',').indexOf('finding');
  return rows.filter(l => l.split(',')[at] === '1').length;
};
const before = inside(), drawn = E.regionsDrawn();
const drawing = new DOMParser().parseFromString(E.drawing(), 'image/svg+xml');
const svg = drawing.querySelector('parsererror') ? 'broken' : drawing.querySelectorAll('path').length > 20;
if (first) first.click();
const jump = [...document.querySelectorAll('.jump a')];
const links = jump.length > 1 && jump.every(a => !a.hidden && document.querySelector(a.getAttribute('href')));
document.title = `touched legend=[${legend}] both=${both} linked=${linked} lines=${lines} ` +
  `picked=${picked} off=${before > 0 && inside() === 0} figure=${E.picture().height > 500} ` +
  `regions=${drawn}-${E.regionsDrawn()} svg=${svg} contents=${links}`;
}
</script>
EOF
# touched PAGE: that title
touched() {
  cat "$1" touch.html > touched.html
  browse 1200,1600 touched.html --dump-dom | grep -o '<title>touched [^<]*' | cut -c8-
}
# findings FOLDER: the sentence and every finding's heading, as diagnosis.json has them, in dom.html
findings() {
  python3 - "$1/diagnosis.json" dom.html <<'EOF'
import html, json, re, sys
d = json.load(open(sys.argv[1]))
page = open(sys.argv[2], encoding='utf-8').read()
text = html.unescape(re.sub(r'<[^>]*>', '', page))
missing = [d['sentence']] * (d['sentence'] not in text)
for f in d['findings']:
    heading = re.search(r'id="finding-%d">\s*<h2>([^<]*)' % f['number'], page)
    if not heading or f['cause'].replace('_', ' ') not in heading.group(1) or f['sentence'] not in text:
        missing.append(f['sentence'])
for m in missing:
    print('missing:', m)
sys.exit(bool(missing))
EOF
}

for name in falcon robot adequate nasty; do
  "$sample" --sample $name $name; check "$name: written" 0 $?
  page $name $name/report.html
  findings $name; check "$name: the sentence and every finding" 0 $?
done
contains "adequate says so" "$(cat adequate/report.html)" 'verdict fine'
contains "what would have been found" "$(cat adequate/report.html)" 'would have been found'

# The tool's own: a constant added to one channel in a quarter of the rows.
if has_command diagnose; then
  awk 'BEGIN {srand(3); print "t_s,s.height_m,u.push,z.speed_mps,m.speed_mps,sd.speed_mps"
    for (i = 0; i < 1500; i++) {h = 50 + 40 * sin(i / 90); n = -6; for (k = 0; k < 12; k++) n += rand()
      m = cos(i / 40); printf "%.2f,%.4f,%.4f,%.5f,%.5f,0.1\n", i * 0.1, h, sin(i / 55), m + 0.1 * n + (h > 75 ? 0.12 : 0), m}}' > log.csv
  "$RIM" diagnose log.csv --out found > /dev/null 2> err.txt; check "rim diagnose" 1 $?
  page diagnose found/report.html
  if [ -f /usr/share/javascript/dygraphs/dygraph.min.js ]; then
    seen=$(touched found/report.html)
    check "no message while it is touched" 0 "$(console)"
    z=$(awk -F, 'NR == 702 {printf "%.3g", $4}' log.csv) m=$(awk -F, 'NR == 702 {printf "%.3g", $5}' log.csv)
    contains "hover: the row's numbers" "$seen" "70: measured: $z[0-9]* simulated: $m[0-9]*"
    contains "hover: in both plots" "$seen" 'both=700 '
    contains "zoom: both plots, and the rows to download" "$seen" 'linked=20-40 lines=202 '
    contains "a rectangle selects" "$seen" 'picked=1500 rows selected'
    contains "a finding switched off" "$seen" 'off=true figure=true'
    contains "its region is drawn, and goes with it" "$seen" 'regions=1-0 '
    contains "the figure as SVG" "$seen" 'svg=true'
    contains "contents" "$seen" 'contents=true'
    RIM_DYGRAPHS=/nowhere "$RIM" diagnose log.csv --out still > /dev/null 2>&1
    check "without dygraphs: no script" 0 "$(grep -c '<script' still/report.html)"
    page still still/report.html
  else
    skipped=$((skipped + 1)); echo "skipped: no dygraphs (Debian: libjs-dygraphs)"
  fi
  findings found; check "diagnose: the sentence and every finding" 0 $?
else
  skipped=$((skipped + 1))
fi

# rim replay --report: what was measured beside what was expected, of a log with its own predictions.
"$RIM" replay log.csv --report flight.html --alarms flight.jsonl > /dev/null 2> err.txt; check "replay --report" 0 $?
mkdir -p flight && cp flight.html flight/report.html
page flight flight/report.html
python3 - flight.jsonl dom.html <<'EOF'
import html, json, re, sys
records = [json.loads(line) for line in open(sys.argv[1])]
text = html.unescape(re.sub(r'<[^>]*>', '', open(sys.argv[2], encoding='utf-8').read()))
last = [r for r in records if r['state'] != 'cleared'][-1]
sys.exit(not (records and last['sentence'] in text and 'Measured against expected' in text and 'What the others say' in text))
EOF
check "flight: the alarm's sentence, its picture, the others" 0 $?
if [ -f /usr/share/javascript/dygraphs/dygraph.min.js ]; then
  seen=$(touched flight/report.html)
  z=$(awk -F, 'NR == 702 {printf "%.3g", $4}' log.csv) m=$(awk -F, 'NR == 702 {printf "%.3g", $5}' log.csv)
  contains "flight: hover" "$seen" "70: measured: $z[0-9]* expected: $m[0-9]*"
  contains "flight: an alarm's region, its SVG, contents" "$seen" 'off=true figure=true regions=1-0 svg=true contents=true'
  check "flight: no message while it is touched" 0 "$(console)"
fi

# A sensor that disagrees with its twin: the report draws what the alarm judged, and says how to make it
# again as a shell would read it.
toy_few 8 900
toy "a drift.csv" 101 900 'if (i > 300) a += 0.2'
"$RIM" replay --model toy.rim "a drift.csv" --report judged.html > /dev/null; check "replay --report of a trained image" 0 $?
contains "what the alarm judged" "$(cat judged.html)" "As the alarm judged it: position a, less what the other outcomes say of it"
contains "the command" "$(cat judged.html)" "<pre>rim replay --model toy.rim &#39;a drift.csv&#39; --report judged.html</pre>"
contains "judged: on a desk" "$(measure judged.html 1200,900)" "covered=0 outside=0 wide=0 pictures=[1-9]"

# rim listen --html: what was published is on the page; other hosts and methods are refused.
url='udpm://239.255.76.67:7691?ttl=0'
timeout 60 "$RIM" listen --lcm "$url" --html 0 --count 1000000 > heard.jsonl 2> listen.log & listener=$!
for _ in $(seq 100); do grep -q 'listening' listen.log && break; kill -0 $listener 2> /dev/null || break; sleep 0.1; done
address=$(sed -n 's/^rim: page at //p' listen.log)
if grep -q 'listening' listen.log; then
  "$RIM" replay log.csv --lcm "$url" --alarms sent.jsonl > /dev/null 2>&1
  browse 1000,1200 ignored --dump-dom > /dev/null 2>&1 # a browser that is warm answers in time
  live() { timeout 60 $browser --no-sandbox --disable-gpu --no-first-run --user-data-dir="$here/profile" --enable-logging=stderr \
    --virtual-time-budget=4000 --dump-dom "$1" 2> browser.log; }
  live "$address" > live.html; check "the live page" 0 $?
  check "the live page: nothing on the console" 0 "$(console)"
  python3 - heard.jsonl live.html <<'EOF'
import html, json, sys
records = [json.loads(line) for line in open(sys.argv[1])]
page = html.unescape(open(sys.argv[2], encoding='utf-8').read())
sys.exit(not records or any(r['sentence'] not in page for r in records) or f'{len(records)} records' not in page)
EOF
  check "every record is on it" 0 $?
  python3 - "$address" <<'EOF' > http.txt
import http.client, sys, urllib.parse
place = urllib.parse.urlparse(sys.argv[1])
def ask(method, path, host):
    c = http.client.HTTPConnection('127.0.0.1', place.port, timeout=5)
    c.putrequest(method, path, skip_host=True); c.putheader('Host', host); c.endheaders()
    return c.getresponse().status
own = f'127.0.0.1:{place.port}'
print(ask('GET', '/', own), ask('GET', '/', 'evil.example'), ask('POST', '/', own), ask('GET', '/etc/passwd', own), ask('GET', '/records?from=99999', own))
EOF
  check "who is answered" "200 403 405 404 200" "$(cat http.txt)"
  check "on 127.0.0.1 alone" 0 "$(python3 -c "
import sys
port = '%04X' % $(echo "$address" | sed 's/.*:\([0-9]*\).*/\1/')
print(sum(l.split()[1].split(':')[1] == port and l.split()[3] == '0A' and l.split()[1].split(':')[0] != '0100007F' for l in open('/proc/net/tcp').readlines()[1:]))")"
else
  skipped=$((skipped + 1)); echo "skipped: no multicast route for rim listen"
fi
kill $listener 2> /dev/null; wait $listener 2> /dev/null
finish
