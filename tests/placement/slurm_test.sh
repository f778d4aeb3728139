#!/bin/bash
# configs/slurm/workers.sbatch in a Slurm of one node that this script starts and ends: own folders, ports and key.
# Three array tasks bake; on the way one is cancelled and one comes to its time limit; the digest must be that of a bake
# with local workers.
#   slurm_test.sh BIN_DIR          exit status 77: skipped, with the reason
set -u
bin=$(cd "$1" && pwd)
root=$(cd "$(dirname "$0")/../.." && pwd)

skip() { echo "skipped: $1"; exit 77; }
for program in slurmctld slurmd sbatch scancel squeue; do
  PATH=$PATH:/usr/sbin command -v $program >/dev/null || skip "$program is not installed (slurm-wlm)"
done
PATH=$PATH:/usr/sbin
[ "$(id -u)" = 0 ] || skip "slurmd needs root to start jobs"

work=$(mktemp -d /tmp/kiln-slurm.XXXXXX)
pids=()
clean_up() {
  scancel --full -u "$(id -un)" >/dev/null 2>&1
  for pid in "${pids[@]}"; do kill "$pid" 2>/dev/null; done
  for pid in "${pids[@]}"; do wait "$pid" 2>/dev/null; done
  rm -rf "$work"
}
trap clean_up EXIT
failed() {
  echo "FAILED: $1"
  tail -n 20 "$work"/*.log 2>/dev/null
  exit 1
}
wait_for() {  # SECONDS WHAT COMMAND...
  local patience=$1 what=$2
  shift 2
  for ((i = 0; i < patience * 10; ++i)); do
    "$@" >/dev/null 2>&1 && return
    sleep 0.1
  done
  failed "$what did not come in $patience s"
}
free_port() { python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'; }

# --- a Slurm of our own ---------------------------------------------------------------------------------------
node=$(hostname -s)
mkdir -p "$work/state" "$work/spool" "$work/share"
export SLURM_CONF=$work/slurm.conf
cat >"$SLURM_CONF" <<END
ClusterName=kilntest
SlurmctldHost=$node(127.0.0.1)
SlurmctldPort=$(free_port)
SlurmdPort=$(free_port)
SlurmUser=root
SlurmdUser=root
AuthType=auth/none
CredType=cred/none
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerType=sched/builtin
SwitchType=switch/none
MpiDefault=none
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
KillWait=20
ReturnToService=2
SlurmdParameters=config_overrides
NodeName=$node NodeAddr=127.0.0.1 CPUs=4 RealMemory=2000 State=UNKNOWN
PartitionName=main Nodes=$node Default=YES MaxTime=INFINITE State=UP OverSubscribe=YES
END
: >"$work/plugstack.conf"
slurmctld -D >"$work/slurmctld.log" 2>&1 &
pids+=($!)
slurmd -D -N "$node" >"$work/slurmd.log" 2>&1 &
pids+=($!)
node_is_up() { sinfo -h -o %T | grep -q idle; }
wait_for 20 "an idle node" node_is_up

# --- the truth: local workers ---------------------------------------------------------------------------------
units=60
export KILN_STUB='slow=100'
mkdir "$work/local"
printf %s secret-of-the-test >"$work/share/token"
cp "$work/share/token" "$work/local/token"
"$bin/kiln-test-farm" "$work/local" $units 2 >"$work/local.out" 2>"$work/local.log" || failed "the local bake"
truth=$(grep ^digest "$work/local.out")

# --- the same bake by array tasks -----------------------------------------------------------------------------
# The one line that names the coordinator; it writes share/address and share/done.
"$bin/kiln-test-farm" "$work/share" $units 0 >"$work/farm.out" 2>"$work/farm.log" &
farm=$!
pids+=("$farm")
wait_for 10 "the coordinator's address" test -s "$work/share/address"

job=$(cd "$work" && KILN_SHARE=$work/share KILN_WORKER=$bin/kiln-stub-worker KILN_CACHE=$work/cache \
  sbatch --parsable --array=0-2 --cpus-per-task=1 --time=10 --output="$work/worker-%a.log" \
  "$root/configs/slurm/workers.sbatch") || failed "sbatch"
are_done() { [ "$(cat "$work/share/done")" -ge "$1" ]; }
wait_for 60 "a dozen units" are_done 12
scancel "${job}_1" || failed "scancel"
wait_for 60 "two dozen units" are_done 24
scancel --batch --signal=TERM "${job}_2" || failed "scancel --batch"  # as --signal=B:TERM does
wait "$farm" || failed "the bake by Slurm's workers"
wait_for 30 "the end of the array job" sh -c "! squeue -h -j $job | grep -q ."

digest=$(grep ^digest "$work/farm.out")
[ "$digest" = "$truth" ] || failed "$digest by Slurm, $truth locally"
for task in 0 1 2; do
  grep -q "connected to 127.0.0.1" "$work/worker-$task.log" || failed "task $task never connected"
done
for task in 1 2; do
  grep -q "told to stop by a signal" "$work/worker-$task.log" || failed "task $task did not hear SIGTERM"
done
# They delivered what ran and said goodbye: nothing was lost with them.
grep -qx "workers lost 0" "$work/farm.out" || failed "a worker that was told to go was lost"
echo "passed: $units units by three array tasks, two told to go: $digest"
