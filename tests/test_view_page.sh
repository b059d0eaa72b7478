#!/bin/bash
# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# usage: tests/test_view_page.sh OVERTAKE PAGES [NAME...]. The page of `overtake view`: its types, and what headless Chromium
# shows of it (tests/browser): all tests but that of Firefox, or those whose name contains a NAME or whose file is NAME.
# PAGES: 1 if OVERTAKE embeds them. Exit code 77 without node, its modules, chromium or the pages, or if all tests named
# were skipped.
# shellcheck source=tests/support/shell_test.sh
source "$(dirname "${BASH_SOURCE[0]}")/support/shell_test.sh"
readonly overtake=$(realpath "$1") project=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly has_pages=$2
shift 2
need "page of overtake view" "tools/setup --node" node chromium
readonly web=$project/tools/view/web
[[ -d $web/node_modules/typescript ]] || { echo "skipped: page of overtake view: no modules (tools/setup --node)"; exit 77; }
((has_pages)) || { echo "skipped: page of overtake view: overtake was built without it (tools/setup --node)"; exit 77; }

expect "types of the page" node "$web/node_modules/typescript/bin/tsc" --project "$web"
node "$project/tests/browser/run.js" "$overtake" "$work" "$@"
code=$?
((code == 77)) && exit 77
((code == 0)) || fail "tests/browser/run.js: exit code $code"
passed
