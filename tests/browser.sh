#!/usr/bin/env bash
# The page of a study in a real browser, without a network: no message on its console, every picture decoded, every figure
# there, nothing wider than the screen, on a desk and on a phone. Needs Debian's chromium, or CHROMIUM.
# Usage: tests/browser.sh path/to/octolux
set -euo pipefail
octolux=$(realpath "$1")
cd "$(dirname "${BASH_SOURCE[0]}")/.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

"$octolux" study scenes/veach-mis.toml -o "$work/report" --budget 8s --no-cache --quiet
page=$work/report/study.html

# What the page has to tell is asked by a script that is added to a copy and writes its answer into the title.
cat > "$work/ask.js" <<'JS'
addEventListener("load", () => {
  const all = s => [...document.querySelectorAll(s)];
  const shown = all(".chart").filter(c => c.getBoundingClientRect().height > 0);
  const problems = [];
  if (all("img").some(i => !i.complete || i.naturalWidth === 0)) problems.push("a picture is not decoded");
  if (all("img").length < 9) problems.push("pictures are missing");
  if (shown.length !== 2) problems.push(shown.length + " charts are shown");
  for (const c of shown) {
    if (c.querySelectorAll("polyline").length < 4) problems.push("a chart has few lines");
    const box = c.querySelector("svg").getBoundingClientRect();
    for (const t of c.querySelectorAll("text")) {
      const b = t.getBoundingClientRect();
      if (b.left < box.left - 1 || b.right > box.right + 1) problems.push("cut off: " + t.textContent.trim());
    }
  }
  if (all("table.prices tbody tr").length < 8) problems.push("the price list is short");
  if (all("table.prices .verdict").length !== all("table.prices tbody tr").length) problems.push("a verdict is missing");
  if (/NaN|undefined|Infinity/.test(document.body.innerText)) problems.push("a figure is missing");
  if (!/\d/.test(document.getElementById("answer").innerText)) problems.push("the headline has no figure");
  const width = document.documentElement.scrollWidth;
  if (width > innerWidth) problems.push("wider than the screen: " + width + " of " + innerWidth);
  document.title = problems.length ? "problems: " + problems.join("; ") : "all is there";
});
JS
{ echo '<script>'; cat "$work/ask.js"; echo '</script>'; } > "$work/script.html"
sed "/<\/head>/{
r $work/script.html
}" "$page" > "$work/asked.html"

for size in 1280,1600 390,1600; do
  # A network that cannot be reached, and a console on standard error.
  dom=$(timeout 120 "${CHROMIUM:-chromium}" --headless --no-sandbox --disable-gpu --disable-background-networking \
    --disable-component-update --no-first-run --host-resolver-rules='MAP * ~NOTFOUND' --user-data-dir="$work/profile" \
    --enable-logging=stderr --window-size="$size" --dump-dom "file://$work/asked.html" 2> "$work/console") || {
    echo "error: the browser failed:" >&2; tail -5 "$work/console" >&2; exit 1
  }
  if grep CONSOLE "$work/console"; then
    echo 'error: the page writes to the console' >&2
    exit 1
  fi
  title=$(grep -o '<title>[^<]*' <<< "$dom" | head -1)
  echo "$size: ${title#<title>}"
  [[ $title == '<title>all is there' ]]
done
