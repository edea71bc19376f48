"""The metrics of a coordinator and a worker that render, the files of the monitoring that query them, and JSON logs.

    metrics_test.py --bin build/release/bin
"""
import argparse
import json
import re
import sys
import urllib.error
import urllib.request

from farm import Farm, wait_until
from paths import ROOM, ROOT

MONITORING = ROOT / "deploy" / "monitoring"


def scrape(port):
    """{name: {labels: value}} of a page in Prometheus' text format; every family has its TYPE."""
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/metrics", timeout=30) as answer:
        text = answer.read().decode()
    values, types = {}, {}
    for line in text.splitlines():
        if match := re.fullmatch(r"# TYPE (\w+) (counter|gauge|histogram|summary)", line):
            types[match[1]] = match[2]
        elif not line.startswith("# HELP "):
            match = re.fullmatch(r'(\w+)(?:\{(.*)\})? (\S+)', line)
            assert match, f"not a sample: {line!r}"
            values.setdefault(match[1], {})[match[2] or ""] = float(match[3])
    for name in values:
        assert name in types or re.sub("_(bucket|sum|count)$", "", name) in types, f"{name} has no type"
    return values


def queried(text):
    """Names of our metrics in a text."""
    return set(re.findall(r"\blightmill_\w+", text))


def panels():
    dashboard = json.loads((MONITORING / "grafana" / "dashboards" / "farm.json").read_text())
    assert len({panel["id"] for panel in dashboard["panels"]}) == len(dashboard["panels"]), "ids must differ"
    for panel in dashboard["panels"]:
        assert panel["targets"], f"{panel['title']}: no query"
        for target in panel["targets"]:
            yield panel["title"], target["expr"], target["datasource"]["uid"]


def check_files(known):
    source = re.search(r"uid: ([\w-]+)", (MONITORING / "grafana" / "datasources.yml").read_text())[1]
    for title, expression, uid in panels():
        assert uid == source, f"{title}: no such data source"
        assert queried(expression) and queried(expression) <= known, f"{title}: {queried(expression) - known} is no metric"
    rules = (MONITORING / "rules.yml").read_text()
    assert queried(rules) and queried(rules) <= known, f"rules.yml: {queried(rules) - known}"
    families = known | {re.sub("_(bucket|sum|count)$", "", name) for name in known}
    page = {name for name in queried((ROOT / "docs" / "compose.md").read_text()) if not name.endswith("_")}
    assert page and page <= families, f"compose.md: {page - families}"
    shown = queried(rules).union(*(queried(expression) for _, expression, _ in panels()))
    return known - shown


def json_lines(log):
    lines = [json.loads(line) for line in log.read_text().splitlines()]
    assert lines and all({"time", "level", "program", "message"} <= set(line) for line in lines), lines
    return lines


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True)
    with Farm(parser.parse_args().bin) as farm:
        farm.environment = {"LIGHTMILL_LOG_FORMAT": "json", "LIGHTMILL_LOG_LEVEL": "debug"}
        farm.start_coordinator()
        http = dict(line.split("=") for line in (farm.folder / "port").read_text().split())["http"]
        farm.start_worker(1, LIGHTMILL_WORKER_HTTP="127.0.0.1:0")
        log = farm.folder / "worker0.log"
        worker = wait_until("the worker's port", lambda: re.search(r"metrics at port (\d+)", log.read_text()))[1]
        assert scrape(http)["lightmill_workers_wanted"][""] == 0, "nothing to do"

        first = farm.submit(ROOM, "--integrator", "bdpt", "--spp", "100000", "--resolution", "64x64")
        farm.wait_for_packets(first, 16)
        wait_until("an error estimate", lambda: f'job="{first}"' in scrape(http).get("lightmill_job_relmse_high", {}))
        running = scrape(http)
        assert running["lightmill_jobs"]['state="running"'] == 1
        for side in (4, 16, 32):
            assert running["lightmill_job_relmse_boxes"][f'job="{first}",side="{side}"'] > 0
        assert 0 < running["lightmill_job_progress"][f'job="{first}"'] < 1
        assert running["lightmill_workers_wanted"][""] >= 1
        assert running["lightmill_work_left_seconds"][""] > 0
        assert running["lightmill_tiles"]['state="leased"'] >= 1
        farm.lightmill("cancel", first)
        assert f'job="{first}"' not in scrape(http).get("lightmill_job_progress", {}), "only running jobs are labels"

        job = farm.submit(ROOM, "--integrator", "bdpt", "--spp", "4", "--resolution", "64x64")
        farm.finish_and_fetch(job, "image.exr")
        done, mine = scrape(http), scrape(worker)
        accepted = done["lightmill_commits_total"]['outcome="accepted"']
        assert accepted >= 2
        assert mine["lightmill_worker_tiles_total"]['outcome="accepted"'] == accepted
        assert done["lightmill_fold_lag_seconds_count"][""] == accepted
        assert done["lightmill_lease_wait_seconds_count"][""] == done["lightmill_leases_total"][""] >= accepted
        assert done["lightmill_samples_total"][""] >= 64 * 64 * 4
        assert done["lightmill_commit_bytes_total"][""] > 0
        # The worker may have sent what the coordinator, for a job that was cancelled, did not take.
        assert mine["lightmill_worker_commit_bytes_total"][""] >= done["lightmill_commit_bytes_total"][""]
        for kind in ("closest_hit", "shadow"):
            rays = f'kind="{kind}"'
            assert mine["lightmill_worker_rays_total"][rays] == done["lightmill_rays_total"][rays] > 0
        scenes = mine["lightmill_worker_scenes_total"]
        assert scenes['from="files"'] == 1, "jobs that differ in when they stop share a scene"
        assert scenes['from="memory"'] >= 1
        wanted = mine["lightmill_worker_blob_bytes_wanted_total"][""]
        assert 0 < mine["lightmill_worker_blob_bytes_fetched_total"][""] <= wanted

        check_logs(farm, job)
        status = farm.json("job", job)
        assert 0 < status["commit_bytes"] < done["lightmill_commit_bytes_total"][""], status["commit_bytes"]

        before = done["lightmill_refusals_total"]['reason="worker_build"']
        farm.start_worker(1, LIGHTMILL_TEST_BUILD_ID="another").wait(timeout=60)
        refused = scrape(http)["lightmill_refusals_total"]['reason="worker_build"']
        assert refused > before, "a worker of another build is counted"

        unseen = check_files(set(running) | set(done) | set(mine))
        print("not in the dashboard:", ", ".join(sorted(name for name in unseen if not name.endswith(("_sum", "_count")))))

        tiles = [line for line in json_lines(log) if "accepted" in line["message"]]
        assert tiles and all(line["job"] in (first, job) and line["tile"] >= 0 and line["attempt"] >= 1 for line in tiles)
        json_lines(farm.folder / "coordinator.log")
        try:
            urllib.request.urlopen(f"http://127.0.0.1:{worker}/", timeout=30)
            raise AssertionError("the worker serves more than /metrics")
        except urllib.error.HTTPError as error:
            assert error.code == 404
        refuses_plain_text(farm)
    print("ok")


def check_logs(farm, job):
    """Every tile was leased and committed, and its own lines say so."""
    tiles = farm.json("tiles", job)
    lines = farm.json("logs", job)
    for tile in tiles:
        own = farm.json("logs", job, "--tile", tile["id"])
        assert own == [line for line in lines if line["tile"] == tile["id"]]
        assert [line["text"].split(":")[0] for line in own] == ["leased", "committed"], own
        assert {line["worker"] for line in own} == {tile["worker"]} and {line["attempt"] for line in own} == {1}, own
    assert len(farm.json("logs", job, "--lines", 1)) == 1
    assert f"tile 0 attempt 1 {tiles[0]['worker']}: leased" in farm.lightmill("logs", job)
    farm.lightmill("logs", "j999", expect=1)


def refuses_plain_text(farm):
    worker = farm.start_worker(1, LIGHTMILL_WORKER_HTTP="0.0.0.0:0")
    assert worker.wait(timeout=60) == 2, "plain text beyond loopback needs --insecure"


if __name__ == "__main__":
    sys.exit(main())
