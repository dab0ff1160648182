"""Run as a process: offers streams and pushes samples as JSON lines order it."""

import json
import sys

import pylsl


def offer(streams):
    outlets = []
    for one in streams:
        labels = one.get("labels", ["X", "Y", "Z"])
        info = pylsl.StreamInfo(
            one["name"], one.get("type", "MoCap"), len(labels), one.get("rate", 120), one.get("format", "double64"),
            one["name"] + one.get("type", ""),
        )  # fmt: skip
        if any(labels):
            info.set_channel_labels(labels)
        if "unit" in one:
            info.set_channel_units(one["unit"])
        outlets.append(pylsl.StreamOutlet(info))
    return outlets


def main():
    outlets = []
    for line in sys.stdin:
        order = json.loads(line)
        if "offer" in order:
            outlets = offer(order["offer"])
        else:
            for row, at_s in zip(order["push"], order["times_s"], strict=True):
                outlets[order["stream"]].push_sample(row, at_s)
        print(json.dumps({"done": True}), flush=True)


main()
