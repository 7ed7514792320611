function result = servobee(record, varargin)
%SERVOBEE  Finds the parameters of a servo valve, and names the effect that its model lacks.
%
%   result = servobee(record)
%   result = servobee(record, 'hold_out', other, 'effects', 'delay,hysteresis', 'out', 'result', 'open', true)
%
%   record    the name of a file, or several in a cell array; a timetable; a table, or a struct of vectors, whose variables are
%             called time, command, spool, flow ... and have units; a matrix with 'columns', one name for each column:
%             {'time [s]', 'command [V]', 'spool [V]'}. Units of a struct's fields come from 'map'.
%   result    what report.json has, as a struct, and beside it
%             result.folder      where the files are, if 'out' names a folder
%             result.residual    every row: time, measured, simulated before and after, a struct of columns
%             result.model       the fitted model, the text of a model file
%
%   Options of this function: 'hold_out', 'columns', 'open' (true shows the page), 'program' (where servobee is).
%   All others are those of the program, `servobee identify --help`, with _ for -: 'map', {'u=command [V]', 'x=spool [mm]'},
%   'hold_out_share', 0.2, 'skip_incomplete_rows', true, 'out', 'folder', 'force', true.
%
%   It runs the program servobee, which has to be on the path. Written by `servobee matlab`, for MATLAB and Octave.

  if mod(numel(varargin), 2) ~= 0
    error('servobee:input', 'options: one has no value; give names and values in turn');
  end
  own = struct('hold_out', [], 'columns', [], 'open', false, 'program', 'servobee', 'out', '');
  passed = {};
  for k = 1:2:numel(varargin)
    name = char(varargin{k});
    value = varargin{k + 1};
    if isfield(own, name)
      own.(name) = value;
    else
      passed = [passed, option(name, value)]; %#ok<AGROW>
    end
  end

  work = tempname();
  mkdir(work);
  clean = onCleanup(@() remove(work));
  call = [{char(own.program), 'identify'}, files(record, own.columns, work, 'record')];
  if ~isempty(own.hold_out)
    call = [call, {'--hold-out'}, files(own.hold_out, own.columns, work, 'held_out')];
  end
  folder = char(own.out);
  if isempty(folder)
    folder = fullfile(work, 'result');
  end
  call = [call, {'--out', folder, '--quiet'}, passed];
  quoted = cellfun(@quote, call, 'UniformOutput', false);
  [status, said] = system([strjoin(quoted, ' '), ' 2>&1']);
  said = strtrim(said);
  % 3: done, and a limit is not met.
  if status ~= 0 && status ~= 3
    kinds = {'servobee:failed', 'servobee:input'};
    error(kinds{1 + (status == 2)}, '%s', said);
  end
  if ~isempty(said)
    warning('servobee:said', '%s', said);
  end

  result = jsondecode(fileread(fullfile(folder, 'report.json')));
  result.residual = columns(fullfile(folder, 'residual.csv'));
  result.model = fileread(fullfile(folder, 'model.toml'));
  result.folder = char(own.out);
  if own.open
    page = fullfile(folder, 'report.html');
    if isempty(own.out)
      kept = [tempname(), '.html'];
      copyfile(page, kept);
      page = kept;
    end
    show(page);
  end
end

function list = option(name, value)
% An option of the program: a flag, or a name with one value after another.
  name = ['--', strrep(name, '_', '-')];
  if islogical(value)
    list = repmat({name}, 1, double(value));
    return
  end
  if ~iscell(value)
    value = {value};
  end
  list = {};
  for k = 1:numel(value)
    text = value{k};
    if isnumeric(text)
      text = sprintf('%.17g', text);
    end
    list = [list, {[name, '=', char(text)]}]; %#ok<AGROW>
  end
end

function list = files(record, names, work, called)
% The files of one record or several: as they are, or written for this call.
  if iscell(record)
    list = {};
    for k = 1:numel(record)
      list = [list, files(record{k}, names, work, sprintf('%s%d', called, k))]; %#ok<AGROW>
    end
    return
  end
  if ischar(record) || isa(record, 'string')
    list = {char(record)};
    return
  end
  [names, values] = taken(record, names);
  rows = cellfun(@numel, values);
  if any(rows ~= rows(1))
    odd = find(rows ~= rows(1), 1);
    error('servobee:input', 'record, %s: has %d values, and %s has %d; give one value for each row', ...
      names{odd}, rows(odd), names{1}, rows(1));
  end
  path = fullfile(work, [called, '.csv']);
  file = fopen(path, 'w');
  if file < 0
    error('servobee:failed', '%s: cannot be written; free some space there', path);
  end
  heads = cellfun(@(name) ['"', strrep(name, '"', '""'), '"'], names, 'UniformOutput', false);
  fprintf(file, '%s\n', strjoin(heads, ','));
  table = cell2mat(values);
  line = [strjoin(repmat({'%.17g'}, 1, numel(names)), ','), '\n'];
  fprintf(file, line, table.');
  fclose(file);
  list = {path};
end

function [names, values] = taken(record, names)
% The columns of a record in memory, and what they are called.
  if isa(record, 'timetable')
    times = record.Properties.RowTimes;
    if isa(times, 'datetime')
      times = times - times(1);
    end
    [own, values] = variables(record);
    names = [{'time [s]'}, own];
    values = [{seconds(times(:))}, values];
  elseif isa(record, 'table')
    [names, values] = variables(record);
  elseif isstruct(record)
    names = fieldnames(record).';
    values = cellfun(@(name) record.(name), names, 'UniformOutput', false);
  elseif isnumeric(record) && ismatrix(record)
    if numel(names) ~= size(record, 2)
      error('servobee:input', 'columns: %d names for %d columns; give ''columns'', {''time [s]'', ''command [V]'', ...}', ...
        numel(names), size(record, 2));
    end
    names = reshape(cellstr(names), 1, []);
    values = num2cell(record, 1);
  else
    error('servobee:input', 'record: is a %s; give a file, a timetable, a table, a struct or a matrix', class(record));
  end
  for k = 1:numel(values)
    if ~isnumeric(values{k}) || ~isvector(values{k}) || ~isreal(values{k})
      error('servobee:input', 'record, %s: is no vector of real numbers; give one value for each row', names{k});
    end
    values{k} = double(values{k}(:));
  end
end

function [names, values] = variables(record)
% The numbers of a table, with their units where it has some.
  all = record.Properties.VariableNames;
  units = record.Properties.VariableUnits;
  names = {};
  values = {};
  for k = 1:numel(all)
    value = record.(all{k});
    if isa(value, 'duration')
      value = seconds(value);
    end
    if ~isnumeric(value)
      continue
    end
    name = all{k};
    if isa(record.(all{k}), 'duration')
      name = [name, ' [s]']; %#ok<AGROW>
    elseif ~isempty(units) && ~isempty(units{k}) && ~any(name == '[')
      name = [name, ' [', units{k}, ']']; %#ok<AGROW>
    end
    names{end + 1} = name; %#ok<AGROW>
    values{end + 1} = value; %#ok<AGROW>
  end
end

function table = columns(path)
% A CSV file as a struct of columns: `spool measured [V]` becomes spool_measured.
  file = fopen(path);
  heads = strsplit(fgetl(file), ',');
  format = repmat({'%f'}, 1, numel(heads));
  text = ismember(heads, {'record', 'part'});
  format(text) = {'%q'};
  if exist('OCTAVE_VERSION', 'builtin')
    format(text) = {'%s'};
  end
  read = textscan(file, strjoin(format, ' '), 'Delimiter', ',');
  fclose(file);
  table = struct();
  for k = 1:numel(heads)
    name = regexprep(strtrim(regexprep(heads{k}, '\[.*\]', '')), '\W', '_');
    table.(name) = read{k};
  end
end

function text = quote(text)
% An argument as the shell takes it.
  if ispc()
    text = ['"', strrep(text, '"', '\"'), '"'];
  else
    text = ['''', strrep(text, '''', '''\'''''), ''''];
  end
end

function remove(folder)
  if exist('OCTAVE_VERSION', 'builtin')
    confirm_recursive_rmdir(false, 'local');
  end
  [~, ~] = rmdir(folder, 's');
end

function show(page)
  if exist('web', 'file') && ~exist('OCTAVE_VERSION', 'builtin')
    web(page, '-browser');
  elseif ispc()
    system(['start "" ', quote(page)]);
  elseif ismac()
    system(['open ', quote(page)]);
  else
    system(['xdg-open ', quote(page), ' >/dev/null 2>&1 &']);
  end
end
