#!/usr/bin/env bash
# Requests a second of `unweld serve` beside nginx, on the same files, in turns: a whole file of 1 MiB and random ranges of 64 KiB of one of
# 64 MiB, from 64 and 1,000 connections (wrk, one thread). Prints a table in Markdown: medians, and processor time of the servers.
#
#   examples/requests.sh [ROUNDS [SECONDS]]      5 rounds of 4 seconds each
#
# It wants nginx, wrk, and the command: $UNWELD, or target/release/unweld.
set -euo pipefail
rounds=${1:-5} seconds=${2:-4}
cd "$(dirname "$0")/.."
unweld=${UNWELD:-target/release/unweld}
nginx=$(command -v nginx || echo /usr/sbin/nginx)
for needed in "$unweld" "$nginx" "$(command -v wrk || echo wrk)"; do
    [ -x "$needed" ] || { echo "$needed is not here" >&2; exit 1; }
done
ulimit -n "$(ulimit -Hn)"

work=$(mktemp -d)
trap 'kill ${servers:-} 2>/dev/null || true; sleep 0.5; rm -rf "$work"' EXIT
mkdir "$work/meshes"
chmod 755 "$work" "$work/meshes"
# Servers do not look into meshes: any bytes will do.
head -c 1048576 /dev/urandom >"$work/meshes/whole.uwm"
head -c 67108864 /dev/urandom >"$work/meshes/large.uwm"

free_port() { python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'; }
declare -A port=([nginx]=$(free_port) [unweld]=$(free_port)) pids
cat >"$work/nginx.conf" <<CONF
worker_processes auto; daemon off; pid $work/pid; error_log stderr crit; worker_rlimit_nofile 8192;
$([ "$(id -u)" = 0 ] && echo "user root;")
events { worker_connections 4096; }
http {
    access_log off; sendfile on; tcp_nopush on; keepalive_requests 1000000;
    client_body_temp_path $work/b; proxy_temp_path $work/p; fastcgi_temp_path $work/f; uwsgi_temp_path $work/u; scgi_temp_path $work/s;
    server { listen 127.0.0.1:${port[nginx]}; root $work; }
}
CONF
cat >"$work/ranges.lua" <<'LUA'
request = function()
   local start = math.random(0, 1023) * 65536
   return wrk.format("GET", "/meshes/large.uwm", { Range = "bytes=" .. start .. "-" .. (start + 65535) })
end
LUA
"$nginx" -e stderr -c "$work/nginx.conf" &
servers=$!
"$unweld" serve "$work/meshes" --addr "127.0.0.1:${port[unweld]}" --quiet &
servers="$servers $!"
pids[unweld]=$!
sleep 1
pids[nginx]=$(pgrep -d ' ' -P "${servers%% *}")

# Hundredths of seconds of processor time of some processes.
used() {
    local sum=0 pid
    for pid in "$@"; do sum=$((sum + $(awk '{ print $14 + $15 }' "/proc/$pid/stat"))); done
    echo $sum
}

echo "load average before: $(cut -d ' ' -f 1 /proc/loadavg)" >&2
for ((round = 0; round < rounds; round++)); do
    for kind in whole range; do
        for connections in 64 1000; do
            for server in nginx unweld; do
                url=http://127.0.0.1:${port[$server]} script=()
                [ $kind = whole ] && url+=/meshes/whole.uwm || script=(-s "$work/ranges.lua")
                before=$(used ${pids[$server]})
                told=$(wrk -t1 -c$connections -d"${seconds}s" --timeout 20s "${script[@]}" "$url")
                after=$(used ${pids[$server]})
                count=$(grep -oP '\d+(?= requests in)' <<<"$told")
                faults=$(grep -cE 'Non-2xx|Socket errors' <<<"$told" || true)
                rate=$(grep -oP 'Requests/sec: *\K[\d.]+' <<<"$told")
                echo "$kind $connections $server $rate $(((after - before) * 10000 / (count + 1))) $faults" >>"$work/told"
            done
        done
    done
done
memory=$(awk '/VmHWM/ { print int($2 / 1024) }' "/proc/${pids[unweld]}/status")
python3 - "$work/told" <<'PYTHON'
import statistics, sys
told = {}
for line in open(sys.argv[1]):
    kind, connections, server, rate, micros, faults = line.split()
    told.setdefault((kind, connections), {}).setdefault(server, []).append((float(rate), int(micros), int(faults)))
print("| | connections | nginx, requests/s | unweld | ratio (median of rounds) | smallest, largest | processor, µs a request: nginx, unweld | errors |")
print("|---|---:|---:|---:|---:|---:|---:|---:|")
for (kind, connections), by in told.items():
    rate = {s: statistics.median(r for r, _, _ in by[s]) for s in by}
    micros = {s: statistics.median(m for _, m, _ in by[s]) for s in by}
    ratios = sorted(u[0] / n[0] for n, u in zip(by["nginx"], by["unweld"]))
    name = {"whole": "whole file, 1 MiB", "range": "range, 64 KiB"}[kind]
    faults = sum(f for s in by for _, _, f in by[s])
    print(f"| {name} | {connections} | {rate['nginx']:.0f} | {rate['unweld']:.0f} | {statistics.median(ratios):.2f} | "
          f"{ratios[0]:.2f}, {ratios[-1]:.2f} | {micros['nginx']:.0f}, {micros['unweld']:.0f} | {faults} |")
PYTHON
echo "memory of unweld at its peak: $memory MiB"
