# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# The plan of a sweep: from sweep.yaml (sweep.schema.yaml) its logs, groups of configurations and parts. A part is one
# job: a log with a group. The Snakefile and tools/dev/evaluate_set use it.
import atexit
import base64
import difflib
import fcntl
import hashlib
import itertools
import json
import math
import os
import re
import shlex
import shutil
import subprocess
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
SCENARIOS = os.path.join(ROOT, 'tools/sim/scenarios')
DAMAGED = 3  # exit code of overtake evaluate: the log is damaged, the results are from the part before the damage
NOT_IN_ALL = ('demo', 'overtake', 'recorded_like')
RESOURCES = {'simulate': {'threads': 1, 'mem_mb': 2000, 'runtime': 120},
             'evaluate': {'threads': 1, 'mem_mb': 3000, 'runtime': 240},
             'merge': {'threads': 1, 'mem_mb': 8000, 'runtime': 240},
             'report': {'threads': 1, 'mem_mb': 8000, 'runtime': 240},
             'times': {'threads': os.cpu_count()}}
LOCK = '.sweep'
LOCK_OF_CALLER = 'OVERTAKE_SWEEP_LOCK'  # its file descriptor, of a program that locks a folder and calls Snakemake
WRITES = ('configs', 'inputs', 'jobs', 'logs', 'parts', 'times', 'whole')
# Options with which Snakemake runs nothing, by their names in its parser.
LOOKS = ('dryrun', 'unlock', 'dag', 'rulegraph', 'filegraph', 'd3dag', 'summary', 'detailed_summary', 'list',
         'list_target_rules', 'list_version_changes', 'list_code_changes', 'list_input_changes', 'list_params_changes',
         'list_untracked', 'lint', 'print_compilation')


class SweepError(Exception):
    """A sentence that begins with the field of sweep.yaml."""


def fail(field, sentence):
    raise SweepError(f'{field}: {sentence}')


KINDS = {'object': 'a group of fields', 'array': 'a list', 'integer': 'a whole number', 'number': 'a number', 'string': 'a text',
         'boolean': 'true or false'}


def flow(value):
    """As one writes it in YAML."""
    return json.dumps(value).replace('"', '')


def list_form(error, form):
    """; write [X], where X alone is given for a list of such."""
    kind = form.get('items', {}).get('type', 'string')
    fits = isinstance(error.instance, {'string': str, 'integer': int, 'number': (int, float)}.get(kind, ()))
    return f'; write [{flow(error.instance)}]' if fits and not isinstance(error.instance, bool) else ''


def sentence_of(error):
    """A ValidationError of jsonschema as one sentence that begins with the field."""
    best = error
    while best.context:  # of several forms, the one that fits best
        best = max(best.context, key=lambda e: len(e.absolute_path))
        if len(best.absolute_path) == len(error.absolute_path):
            best = error
            break
    field = '.'.join(str(p) for p in best.absolute_path)
    example = best.schema.get('examples', [None])[0]
    if best.validator == 'anyOf':
        return 'scenarios or recordings: one of them is needed'
    if best.validator == 'additionalProperties':
        known = sorted(best.schema['properties'])
        unknown = sorted(str(name) for name in set(best.instance) - set(known))
        return f"{'.'.join(filter(None, [field, unknown[0]]))}: there is no such field; there are {', '.join(known)}"
    if best.instance == [] and best.validator in ('oneOf', 'minItems'):
        return f'{field}: the list is empty'
    if best.validator in ('oneOf', 'enum'):
        forms, remedy = [], ''
        for form in best.schema.get('oneOf', [best.schema]):
            if 'const' in form or 'enum' in form:
                forms += [word for word in form.get('enum', [form.get('const')]) if word is not False]
            else:
                forms.append('a text' if form.get('type') == 'string' else 'a list')
                remedy = list_form(best, form) if form.get('type') != 'string' else remedy
        return f"{field}: {json.dumps(best.instance)} is none of {', '.join(forms)}{remedy}"
    if best.validator == 'pattern' and example is not None:
        field = f'{field}.{best.instance}' if 'propertyNames' in best.absolute_schema_path else field
        return f"{field}: '{best.instance}' is not of the form {example}"
    if best.validator == 'type':
        remedy = list_form(best, best.schema) if best.validator_value == 'array' else f'; write {flow(example)}' if example else ''
        return f"{field or 'the file'}: {json.dumps(best.instance)} is not {KINDS[best.validator_value]}{remedy}"
    return f"{field or 'the file'}: {best.message}"


def words_of(arguments, *names):
    """The values of an option of Snakemake."""
    out = []
    for k, word in enumerate(arguments):
        for name in names:
            if word == name:
                out += itertools.takewhile(lambda w: not w.startswith('-'), arguments[k + 1:])
            elif name.startswith('--') and word.startswith(name + '='):
                out.append(word[len(name) + 1:])
    return out


def only_looks(arguments):
    return any(getattr(arguments, name, None) for name in LOOKS)


def check_version(version):
    """Snakemake 8 has no --cluster, and its workflow has no mode."""
    number = [int(n) for n in re.findall('[0-9]+', version)[:2]]
    if not [7, 21] <= number < [8]:
        fail('snakemake', f'version 7.21 or newer, but older than 8, is needed, not {version}: pip install "snakemake>=7.21,<8"')


def read_yaml(path, field):
    """The fields of a YAML or JSON file; file, line and column of what is none."""
    import yaml  # Snakemake brings it
    try:
        text = read_text(path, field)
        try:
            found = json.loads(text)
        except ValueError:
            found = yaml.safe_load(text)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        fail(field, f'{path}:{mark.line + 1}:{mark.column + 1}: {error.problem or error.context}')
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        fail(field, f"{path}: {str(error).splitlines()[0]}")
    if not isinstance(found, dict):
        fail(field, f"{path}: {'the file is empty' if found is None else 'it has no fields'}; write fields as scenarios: [overtake]")
    return found


def parse_arguments(snakemake, words):
    """Snakemake's options, those of its profile, too. Snakemake runs the profile's programs in the folder of --directory:
    it must find them from there."""
    profile = snakemake.get_argument_parser().parse_known_args(words)[0].profile
    if profile and not os.path.isabs(profile) and not snakemake.get_profile_file(profile, 'config.yaml'):
        fail('--profile', f'{profile} must be an absolute path: "$PWD/{profile}"')
    return snakemake.get_argument_parser(profile).parse_known_args(words)[0]


def check_slurm():
    """Where Slurm does not answer, Snakemake would try each job, one after the other."""
    for program in ('sbatch', 'squeue', 'scancel'):
        if not shutil.which(program):
            fail('--profile', f'its jobs need Slurm, and there is no {program} on this machine; '
                              'without --profile, -j N runs the jobs here')
    try:
        done = subprocess.run(['squeue', '--me', '--noheader'], capture_output=True, text=True, timeout=60)
        problem = done.stderr.strip().split('\n')[-1] or 'squeue fails' if done.returncode else None
    except subprocess.TimeoutExpired:
        problem = 'squeue waited for 60 s'
    if problem:
        fail('--profile', f'Slurm does not answer ({problem}); a cluster of tools/cluster/start FOLDER needs: source FOLDER/env')


def quote(words):
    return ' '.join(shlex.quote(word) for word in words)


def find_program(name):
    if name is None:
        name = os.path.join(ROOT, 'build/release/overtake')
        name = name if os.path.exists(name) else 'overtake'
    path = shutil.which(name)
    if path is None:
        fail('overtake', f"'{name}' is not there: build it, or name another one")
    return os.path.abspath(path)


def run(program, *arguments):
    return subprocess.run([program, *arguments], capture_output=True, text=True)


def read_text(path, field):
    try:
        with open(path) as file:
            return file.read()
    except OSError as error:
        fail(field, f'{path}: {error.strerror}')


# ---- logs


def built_in():
    return [name[:-5] for name in sorted(os.listdir(SCENARIOS)) if name.endswith('.toml')]


def scenario_file(scenario, base):
    """The scenario's TOML file; None: built into the program, and without the source tree."""
    if scenario.endswith('.toml'):
        return os.path.join(base, scenario)
    path = os.path.join(SCENARIOS, scenario + '.toml')
    if os.path.isdir(SCENARIOS) and not os.path.exists(path):
        names = built_in()
        near = difflib.get_close_matches(scenario, names, 1)
        there = f"the nearest is '{near[0]}'" if near else f"there are {', '.join(names)}"
        fail('scenarios', f"there is no scenario '{scenario}'; {there}; one of your own is a path that ends in .toml")
    return path if os.path.exists(path) else None


def scenario_fields(path, text):
    import tomllib  # of Python 3.11
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        fail('scenarios', f'{path}: {error}')


def seeds_of(seeds, scenario, about):
    if isinstance(seeds, list):
        return seeds
    numbers = about.get('tune_seeds' if seeds == 'tune' else 'test_seeds')
    if not numbers:
        fail('seeds', f"{scenario} names no seeds for '{seeds}'")
    return numbers[:1] if seeds == 'first' else numbers


def simulated_logs(config, base):
    scenarios, seconds = config['scenarios'], config.get('seconds')
    if scenarios == 'all':
        scenarios = ['las_vegas_15'] + [n for n in built_in() if n != 'las_vegas_15' and n not in NOT_IN_ALL]
    # The report shows a spin, and this race has none.
    if 'las_vegas_15' in scenarios and 'spin_near' not in scenarios and seconds is None:
        scenarios = scenarios + ['spin_near']
    logs, texts = {}, {}
    for scenario in scenarios:
        path = scenario_file(scenario, base)
        text = read_text(path, 'scenarios') if path else ''
        name = os.path.basename(scenario)[:-5] if scenario.endswith('.toml') else scenario
        if name in texts:
            fail('scenarios', f"two scenarios have the name '{name}'")
        texts[name] = text
        about = scenario_fields(path, text)
        for seed in seeds_of(config['seeds'], name, about):
            options = [path if scenario.endswith('.toml') else scenario, '--seed', str(seed)]
            options += [] if seconds is None else ['--seconds', f'{seconds:g}']
            log = f'{name}_{seed}' + ('' if seconds is None else f'_{seconds:g}s')
            logs[log] = {'scenario': name, 'options': options}
            if 'pieces' in config:
                if seconds is None and 'seconds' not in about:
                    fail('pieces', f'{name} does not say how long it takes: give seconds')
                logs[log]['length_s'] = min(seconds or 1e9, about.get('seconds', 1e9))
    return logs, texts


def is_recording(path):
    if os.path.isdir(path):
        return any(n.endswith(('.db3', '.mcap', '.pcd', '.bin', '.ply')) for n in os.listdir(path))
    return path.endswith(('.db3', '.mcap'))


def length_of(path, program):
    done = run(program, 'info', path, '--json')
    try:
        about = json.loads(done.stdout)
        return (about['last_ns'] - about['first_ns']) * 1e-9
    except (ValueError, KeyError, TypeError):
        fail('pieces', f'{path} does not say how long it takes: {done.stderr.strip() or "it has no times"}')


def recorded_logs(config, base, program):
    given = config['recordings']
    if isinstance(given, str):
        folder = os.path.join(base, given)
        if not os.path.isdir(folder):
            fail('recordings', f'{folder} is no folder; a single recording is a list: [{given}]')
        paths = [os.path.join(folder, n) for n in sorted(os.listdir(folder)) if is_recording(os.path.join(folder, n))]
        if not paths:
            fail('recordings', f'{folder} holds no recording (.db3, .mcap, folders)')
    else:
        paths = [os.path.join(base, path) for path in given]
    logs = {}
    for path in paths:
        path = os.path.abspath(path)
        name = os.path.splitext(os.path.basename(path))[0]
        if not os.path.exists(path):
            fail('recordings', f'{path} is not there')
        if not config.get('rig') and not path.endswith('.mcap'):
            fail('rig', f'{path} needs it: only logs of overtake simulate hold their own')
        if name in logs:
            fail('recordings', f"two recordings have the name '{name}': their results would lie in one folder")
        logs[name] = {'path': path}
        if 'pieces' in config:
            logs[name]['length_s'] = length_of(path, program)
    return logs


def pieces_of(log, config):
    """The options of each piece of a log, by the end of its name."""
    if 'pieces' not in config:
        return {'': []}
    step, warm_up = config['pieces']['seconds'], config['pieces'].get('warm_up', 30)
    count = max(1, math.ceil(log['length_s'] / step - 1e-9))
    if count == 1:
        return {'': []}
    out = {}
    for k in range(count):
        options = ['--from', number(round(k * step, 9)), '--warm-up', number(warm_up)]
        out[f'_from_{number(round(k * step, 9))}s'] = options + (['--to', number(round((k + 1) * step, 9))] if k + 1 < count else [])
    return out


# ---- contestants


def number(value):
    return f'{value:g}' if float(f'{value:g}') == value else repr(value)


def grid_configs(config, presets):
    """name -> TOML text, for each point of the grid."""
    grid = config.get('grid')
    if not grid:
        return {}
    parameters = grid['parameters']
    if grid.get('combine', 'product') == 'single':
        points = [((name, value),) for name, values in parameters.items() for value in values]
    else:
        points = list(itertools.product(*[[(name, v) for v in values] for name, values in parameters.items()]))
    out = {}
    for preset in grid.get('presets', presets):
        for point in points:
            groups = {}
            for name, value in point:
                group, key = name.split('.')
                groups.setdefault(group, []).append(f'{key} = {number(value)}\n')
            text = f'preset = "{preset}"\n' + ''.join(f'\n[{g}]\n{"".join(rows)}' for g, rows in groups.items())
            out['_'.join([preset] + [f'{name}={number(value)}' for name, value in point])] = text
    return out


def read_contestants(config, base):
    """Presets, and the configurations by their names."""
    presets = list(config.get('presets', []))
    configs = {}
    for file in config.get('configurations', []):
        name = os.path.basename(file)
        name = name[:-5] if name.endswith('.toml') else name
        if name in configs:
            fail('configurations', f"two configurations have the name '{name}'")
        configs[name] = read_text(os.path.join(base, file), 'configurations')
    if config.get('grid') and not presets and 'presets' not in config['grid']:
        fail('grid.presets', 'is needed, or presets')
    for name, text in grid_configs(config, presets).items():
        if name in configs:
            fail('configurations', f"'{name}' has the name of a point of the grid")
        configs[name] = text
    if not presets and not configs:
        presets = ['paper']
    return presets, configs


def options_of(presets, configs):
    out = ['--preset', ','.join(presets)] if presets else []
    return out + (['--config', ','.join(f'configs/{name}.toml' for name in configs)] if configs else [])


# ---- the plan


def write_configs(configs, folder):
    for name, text in configs.items():
        write_changed(os.path.join(folder, f'configs/{name}.toml'), text)


def check(program, config, presets, configs):
    """Asks the program whether these contestants can run."""
    extra = ['--sweep', config['sweep']] if config.get('sweep') else []
    extra += ['--variants'] if config.get('variants') else []
    with tempfile.TemporaryDirectory() as folder:
        write_configs(configs, folder)
        done = subprocess.run([program, 'evaluate', '--check', *options_of(presets, configs), *extra, '--out', 'out'],
                              capture_output=True, text=True, cwd=folder)
    if done.returncode:
        sentence = re.sub('^overtake: ', '', done.stderr.split('\n')[0])
        field = 'sweep' if sentence.startswith('--sweep') else 'presets' if sentence.startswith('--preset') else (
            'grid' if config.get('grid') else 'configurations')
        fail(field, sentence)


def plan_of(config, config_file, validate):
    """The plan of config_file, whose content is `config`; `validate` (of snakemake.utils) sets its defaults. Throws
    SweepError: the file, and a sentence that begins with the field."""
    try:
        validate(config, os.path.join(HERE, 'sweep.schema.yaml'))
    except Exception as error:
        if not hasattr(error.__context__, 'absolute_path'):  # a ValidationError
            raise
        raise SweepError(f'{config_file}: {sentence_of(error.__context__)}') from None
    try:
        return make_plan(config, os.path.dirname(os.path.abspath(config_file)))
    except SweepError as error:
        raise SweepError(f'{config_file}: {error}') from None


def make_plan(config, base):
    """The plan of a valid config (with its defaults); `base`: the folder of its paths. Throws SweepError."""
    program = find_program(os.path.join(base, config['overtake'])
                           if '/' in config.get('overtake', '') else config.get('overtake'))
    logs, scenarios = simulated_logs(config, base) if 'scenarios' in config else ({}, {})
    if 'recordings' in config:
        recorded = recorded_logs(config, base, program)
        for name in set(recorded) & set(logs):
            fail('recordings', f"'{name}' has the name of a simulated race")
        logs.update(recorded)
    presets, configs = read_contestants(config, base)
    whole = config['extent'] == 'whole'
    all_of = [('preset', name) for name in presets] + [('config', name) for name in configs]
    size = len(all_of) if whole else config['contestants_per_job']  # baselines and times are those of the first one
    groups = {}
    for k in range(0, len(all_of), size):
        members = all_of[k:k + size]
        options = options_of([n for kind, n in members if kind == 'preset'], [n for kind, n in members if kind == 'config'])
        if k == 0:
            options += ['--variants'] if config['variants'] else []
            options += ['--sweep', config['sweep']] if config.get('sweep') else []
        groups[str(len(groups) + 1)] = options
    judge = [] if whole else ['--only-figures']
    for key, option in (('compare_every', '--compare-every'), ('every', '--every')):
        judge += [option, str(config[key])] if key in config else []
    of_recording = []
    for key in ('rig', 'map'):
        if key in config:
            path = os.path.join(base, config[key])
            of_recording += [f'--{key}', os.path.abspath(path) if os.path.exists(path) else config[key]]
    if 'pieces' in config and whole:
        fail('pieces', 'they need extent: figures')
    parts = {}
    for log, about in logs.items():
        for ending, times in pieces_of(about, config).items():
            for group in groups:
                name = log + ending + ('' if len(groups) == 1 else f'.{group}')
                options = judge + times + (of_recording if 'path' in about else [])
                parts[name] = {'log': log, 'group': group, 'options': options}
    targets = list(parts)
    if config.get('shard'):
        index, count = (int(word) for word in config['shard'].split('/'))
        if index > count:
            fail('shard', f"I/N with 1 <= I <= N is needed, not '{config['shard']}'")
        targets = targets[index - 1::count]
        if not targets:
            fail('shard', f"{config['shard']} of {len(parts)} jobs is empty")
    measured = ['scaling.json'] if config['times'] else []
    measured += ['recordings.json'] if config.get('data_sets') else []
    against = [os.path.abspath(os.path.join(base, folder)) for folder in config.get('against', [])]
    for k, folder in enumerate(against):
        if not os.path.isfile(os.path.join(folder, 'metrics.json')):
            fail(f'against.{k}', f"'{config['against'][k]}' has no metrics.json")
    results = ['metrics.json', 'report.html'] + (['comparison.json'] if against else [])
    resources = {rule: {**RESOURCES[rule], **config.get('resources', {}).get(rule, {})} for rule in RESOURCES}
    check(program, config, presets, configs)
    texts = {'build': run(program, '--version').stdout, 'judge': quote(judge) + '\n' + quote(of_recording) + '\n',
             'first': quote(options_of(presets, configs)) + '\n' + ''.join(configs.values()),
             'pieces': json.dumps(config.get('pieces', {})) + '\n',
             'parts': ''.join(f'parts/{part}\n' for part in targets)}
    for path in of_recording[1::2]:
        if os.path.isfile(path):
            with open(path, 'rb') as file:
                texts['judge'] += hashlib.sha256(file.read()).hexdigest() + '\n'
    for scenario, text in scenarios.items():
        texts[f'scenarios/{scenario}'] = text
    for group, options in groups.items():
        names = [re.sub(r'^configs/|\.toml$', '', word) for option in options for word in option.split(',')]
        texts[f'groups/{group}'] = quote(options) + '\n' + ''.join(configs[n] for n in names if n in configs)
    return {'overtake': shlex.quote(program), 'logs': logs, 'groups': groups, 'parts': parts, 'targets': targets,
            'results': measured if config.get('shard') else results, 'against': against,
            'measured': measured, 'data_sets': config.get('data_sets') and os.path.join(base, config['data_sets']),
            'first': options_of(presets, configs), 'keep_logs': config['keep_logs'] or 'no', 'retries': config['retries'],
            'resources': resources, 'texts': texts, 'configs': configs}


def write_changed(path, text):
    """Leaves a file of the same content alone, and its time with it. True: there was another one."""
    before = None
    if os.path.exists(path):
        with open(path) as file:
            before = file.read()
    if before == text:
        return False
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path + '.part', 'w') as file:
        file.write(text)
    os.replace(path + '.part', path)
    return before is not None


def is_config(path, configs):
    name = os.path.basename(path)
    if not name.endswith('.toml') or name[:-5] not in configs or not os.path.isfile(path):
        return False
    with open(path, 'rb') as file:
        return file.read() == configs[name[:-5]].encode()


def check_folder(plan, folder='.'):
    """A sweep replaces and deletes files of these names: it needs a folder of its own. Races made by hand are taken, and
    the plan's configurations may be there (tools/dev/ablation)."""
    there = lambda *names: any(os.path.exists(os.path.join(folder, name)) for name in names)
    foreign = [] if there(LOCK, 'inputs/plan.json') else [name for name in WRITES if there(name)]
    if plan['keep_logs'] == 'any' and 'logs' in foreign:
        foreign.remove('logs')
    configs = os.path.join(folder, 'configs')
    if os.path.isdir(configs) and all(is_config(os.path.join(configs, n), plan['configs']) for n in os.listdir(configs)):
        foreign = [name for name in foreign if name != 'configs']
    if there('runs') and not there('.overtake'):
        foreign.append('runs')
    if foreign:
        fail('--directory', f'{os.path.abspath(folder)}/{foreign[0]} is not of a sweep: choose another folder')


def lock_folder(folder='.'):
    """One sweep at a time, which also plans alone: jobs that start later read the plan's files. The lock that Snakemake
    leaves when it is killed does not do. Returns the file that holds the lock."""
    file = open(os.path.join(folder, LOCK), 'a')
    try:
        if os.path.sameopenfile(int(os.environ.get(LOCK_OF_CALLER, '-1')), file.fileno()):
            return file
    except (OSError, ValueError, OverflowError):
        pass
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        fail('--directory', f'{os.path.abspath(folder)}: another sweep is running there')
    except OSError:
        pass  # a file system without locks: Snakemake's own is left
    return file


def shadow_of(folder):
    """A temporary folder that shows what `folder` holds, for a plan that changes nothing in it."""
    shadow = tempfile.mkdtemp(prefix='overtake_sweep_')
    atexit.register(shutil.rmtree, shadow, ignore_errors=True)
    for name in os.listdir(folder):
        path, link = os.path.join(os.path.abspath(folder), name), os.path.join(shadow, name)
        if name in ('configs', 'inputs'):
            shutil.copytree(path, link)  # with the files' times
        else:
            os.symlink(path, link)
            about = os.lstat(path)
            os.utime(link, ns=(about.st_atime_ns, about.st_mtime_ns), follow_symlinks=False)
    return shadow


def write_plan(plan, folder='.'):
    write_configs(plan['configs'], folder)
    changed = [name for name, text in plan['texts'].items() if write_changed(os.path.join(folder, 'inputs', name), text)]
    if 'build' in changed or 'first' in changed:  # also where this sweep does not measure them
        for name in ('scaling.json', 'recordings.json'):
            if os.path.exists(os.path.join(folder, name)):
                os.remove(os.path.join(folder, name))
    stored = {key: value for key, value in plan.items() if key not in ('texts', 'configs')}
    write_changed(os.path.join(folder, 'inputs/plan.json'), json.dumps(stored, indent=1) + '\n')


def unlink_unnoted(plan):
    """Removes races that are whole (once.py) and marked as incomplete by Snakemake 7.21. It would make such a race again and
    nothing that reads it, because the race is ancient() there. A race that is missing is taken from the folder whole."""
    for name in plan['logs']:
        log = f'logs/{name}.mcap'
        mark = os.path.join('.snakemake/incomplete', base64.b64encode(log.encode(), altchars=b'-_').decode())
        if os.path.exists(mark) and os.path.exists(log) and os.path.exists(f'whole/simulate/{name}/{name}.mcap'):
            os.remove(log)


def read_plan(folder='.'):
    with open(os.path.join(folder, 'inputs/plan.json')) as file:
        return json.load(file)


def hint(resources, log):
    """After a failed sweep: where its jobs say why, and the fields that give them more."""
    rows = ['A job failed; what jobs print is in the folder jobs (jobs/slurm: of Slurm).']
    started, failed = '', set()
    for line in log.splitlines():
        found = re.match(r'(Error in )?rule (\w+):$', line)
        if found:
            started = found.group(2)
        if line.startswith('Error in rule') or line.startswith('Error submitting jobscript'):
            failed.add(started)
    for rule in sorted(failed):
        of = {'compare': 'report', 'times': 'evaluate', 'data_sets': 'evaluate'}.get(rule, rule)
        if of in resources:
            memory, minutes = resources[of]['mem_mb'], resources[of]['runtime']
            rows.append(f'{rule}: if it lacks memory or time, or Slurm refuses it: resources.{of}.mem_mb (now {memory}), '
                        f'resources.{of}.runtime (now {minutes} min) in sweep.yaml; half as much again at each attempt')
    return '\n'.join(rows)
