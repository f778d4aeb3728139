#include "coordinator/farm/web/page.h"

#include "common/base/format.h"

namespace kiln {
namespace {

constexpr const char* kStyle = R"(
:root { color-scheme: light dark; --line: #8884; --soft: #8882; --good: #2a8f4f; --bad: #c8372d; --bar: #d9822b; }
body { font: 15px/1.45 system-ui, sans-serif; margin: 2rem auto; max-width: 76rem; padding: 0 1.25rem; }
h1 { font-size: 1.4rem; margin: 0; } h2 { font-size: 1.05rem; margin: 2rem 0 .5rem; }
header { display: flex; justify-content: space-between; align-items: baseline; gap: 1rem; flex-wrap: wrap; }
#held { background: var(--bad); color: #fff; padding: .5rem .75rem; border-radius: .4rem; margin: 1rem 0; }
#numbers { display: flex; flex-wrap: wrap; gap: .5rem 2rem; margin-top: 1rem; }
#numbers div span { display: block; font-size: 1.3rem; font-variant-numeric: tabular-nums; }
.soft, #numbers { opacity: .85; }
table { border-collapse: collapse; width: 100%; } .scroll { overflow-x: auto; }
th, td { text-align: left; padding: .3rem .75rem .3rem 0; border-bottom: 1px solid var(--line); vertical-align: top; }
th { font-weight: 600; white-space: nowrap; } td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; }
.bar { background: var(--soft); border-radius: .3rem; height: .55rem; width: 9rem; margin-top: .4rem; overflow: hidden; }
.bar i { display: block; height: 100%; background: var(--bar); }
.done { color: var(--good); } .failed, .silent, .benched { color: var(--bad); }
.reason { max-width: 30rem; overflow-wrap: anywhere; }
[hidden] { display: none !important; }
)";

constexpr const char* kBody = R"(
<header><h1>Kiln</h1><span class="soft" id="when">loading</span></header>
<form id="ask" hidden><p>This coordinator asks for a token.</p>
<input id="token" type="password" aria-label="token" autocomplete="off"> <button>Show</button></form>
<div id="held" role="alert" hidden></div>
<div id="numbers"></div>
<p id="data" class="soft"></p>
<h2>Jobs</h2><div class="scroll"><table><thead><tr><th class="n">Job</th><th>Name</th><th>User</th>
<th>State</th><th>Pass</th><th class="n">Workers</th><th class="n">Rays</th><th>Why</th></tr></thead>
<tbody id="jobs"></tbody></table></div>
<h2>Workers</h2><div class="scroll"><table><thead><tr><th>Worker</th><th>State</th><th class="n">Job</th>
<th class="n">Threads</th><th class="n">Units done</th><th class="n">Failed</th><th class="n">Rays per second</th>
<th>Release</th></tr></thead><tbody id="workers"></tbody></table></div>
)";

// All external data is set as text, never as markup.
constexpr const char* kScript = R"(
'use strict';
const $ = id => document.getElementById(id);
const cell = (row, text, kind) => {
  const td = row.insertCell();
  td.textContent = text;
  if (kind) td.className = kind;
  return td;
};
const short = n => {
  for (const [unit, size] of [['T', 1e12], ['G', 1e9], ['M', 1e6], ['k', 1e3]])
    if (n >= size) return (n / size).toFixed(1) + ' ' + unit;
  return String(Math.round(n));
};
const get = async path => {
  const token = sessionStorage.getItem('token');
  const reply = await fetch(path, token ? {headers: {Authorization: 'Bearer ' + token}} : {});
  if (reply.status === 401) { $('ask').hidden = false; throw new Error('a token is needed'); }
  if (!reply.ok) throw new Error(path + ': ' + reply.status);
  $('ask').hidden = true;
  return reply.json();
};
const fill = (id, rows, empty, write) => {
  const body = document.createElement('tbody');
  body.id = id;
  for (const r of rows) write(body.insertRow(), r);
  if (!rows.length) { const td = cell(body.insertRow(), empty, 'soft'); td.colSpan = 8; }
  $(id).replaceWith(body);
};
const number = (box, name, value) => {
  const div = document.createElement('div'), big = document.createElement('span');
  big.textContent = value;
  div.append(big, name);
  box.append(div);
};
const bytes = n => short(n) + 'B';
const show = (status, jobs, workers) => {
  $('held').hidden = !status.held_for;
  $('held').textContent = 'Nothing is handed out: ' + status.held_for;
  const active = jobs.filter(j => !['done', 'failed', 'cancelled'].includes(j.state));
  const box = document.createElement('div');
  box.id = 'numbers';
  number(box, 'jobs to do', active.length);
  number(box, 'workers', status.workers);
  number(box, 'threads', status.threads);
  number(box, 'rays per second', short(status.rays_per_second));
  number(box, 'results', short(status.results));
  const data = status.data, growth = data.growth_bytes_a_day;
  number(box, 'stored', bytes(data.size_bytes.total));
  number(box, 'growth a day', growth ? bytes(growth.total) : 'measuring');
  number(box, 'free', bytes(data.free_bytes));
  if (data.days_until_full !== undefined) number(box, 'days until full', short(data.days_until_full));
  $('numbers').replaceWith(box);
  const next = data.retention, date = ms => new Date(ms).toLocaleString();
  $('data').textContent = [
    Object.entries(data.size_bytes).map(([kind, n]) => kind + ' ' + bytes(n)).join(', '),
    next.next_ms ? 'next deletion: ' + next.next_jobs.length + ' jobs, ' + bytes(next.next_bytes) + ', from ' +
      date(next.next_ms) : 'nothing grows old',
    data.backup.last_ms ? 'last backup: ' + date(data.backup.last_ms) : 'no backup is known',
    status.clock_doubt].filter(Boolean).join('; ');
  const order = active.concat(jobs.filter(j => !active.includes(j)).slice(0, 50));
  fill('jobs', order, 'No job: kiln submit SCENE', (row, j) => {
    cell(row, j.id, 'n');
    cell(row, j.name);
    cell(row, j.user);
    cell(row, j.paused ? j.state + ', paused' : j.state, j.state);
    const now = j.progress;
    const pass = cell(row, !now ? j.passes_done ? j.passes_done + ' passes' : '' : now.stage !== 'bake' ? now.stage :
      'pass ' + now.pass + ': ' + now.units_done + ' of ' + now.units_total + ' units');
    if (now && now.pass_share > 0) {
      const bar = document.createElement('div'), full = document.createElement('i');
      bar.className = 'bar';
      full.style.width = 100 * now.pass_share + '%';
      bar.append(full);
      pass.append(bar);
    }
    cell(row, now ? now.workers : '', 'n');
    cell(row, now ? short(now.rays) : '', 'n');
    cell(row, [j.reason, j.taint, j.verification].filter(Boolean).join('; '), 'reason');
  });
  fill('workers', workers, 'No worker: kiln-worker --connect HOST:PORT', (row, w) => {
    cell(row, w.name);
    cell(row, w.state, w.state);
    cell(row, w.job || '', 'n');
    cell(row, w.threads, 'n');
    cell(row, w.units_done, 'n');
    cell(row, w.units_failed || '', 'n');
    cell(row, short(w.rays_per_second), 'n');
    cell(row, w.release);
  });
  $('when').textContent = 'release ' + status.release + ', ' + new Date().toLocaleTimeString();
};
const refresh = async () => {
  try {
    const [status, jobs, workers] = await Promise.all(
      ['status', 'jobs', 'workers'].map(name => get('/api/' + name + '.json')));
    show(status, jobs.jobs, workers.workers);
  } catch (e) {
    $('when').textContent = 'no answer: ' + e.message;
  }
};
$('ask').addEventListener('submit', e => {
  e.preventDefault();
  sessionStorage.setItem('token', $('token').value);
  refresh();
});
refresh();
setInterval(() => { if (!document.hidden) refresh(); }, 2000);
)";

}  // namespace

std::string status_page(const std::string& nonce) {
  return text(
      "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>Kiln</title>"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">"
      "<link rel=\"icon\" href=\"data:,\"><style nonce=\"{}\">{}</style></head><body>{}"
      "<script nonce=\"{}\">{}</script></body></html>\n",
      nonce, kStyle, kBody, nonce, kScript);
}

// Inline widths of the bars are set through the style object, which the policy allows.
std::string page_policy(const std::string& nonce) {
  return text(
      "default-src 'none'; script-src 'nonce-{}'; style-src 'nonce-{}'; connect-src 'self'; img-src data:; "
      "base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
      nonce, nonce);
}

}  // namespace kiln
