(* The books of posts fit who stands where: every step of vehicles and posts keeps that. *)
Require Import Posts.

Section Books.
Context `{R : roads}.

(* books and lines *)
Record sound (s : state) : Prop := {
  i_place : forall e p, In e (book s p) \/ In e (rears s p) -> stands e = p /\ granted s e = true;
  i_once : forall p, NoDup (book s p ++ rears s p);
  i_room : forall p, length (book s p) + length (rears s p) + held s p <= slots p;
  i_last : forall p, kept s p <> None -> S (length (book s p)) = slots p /\ settled s (book s p);
  i_known : forall p, exists l m, book s p = l ++ m /\ settled s l /\ length m <= 1;
  i_queue : forall p, queue s p = filter (fun e => used s e && negb (gone s e)) (book s p);
  i_used : forall e, used s e = true -> granted s e = true;
  i_out : forall e, out s e = true -> gone s e = true;
  i_rears : forall e p, In e (rears s p) -> gone s e = true;
  i_space : forall e, granted s e = true -> out s e = false -> In e (book s (stands e)) \/ In e (rears s (stands e));
  i_asked : forall f, asked s f = true -> stands f = wants (src f) /\ veh f = veh (src f) /\ used s (src f) = true /\
    (gone s f = true \/ (used s f = true /\ gone s (src f) = true) \/
     (used s f = false /\ gone s (src f) = false /\ hd_error (queue s (stands (src f))) = Some (src f)));
  i_one : forall e f, used s e = true -> used s f = true -> gone s e = false -> gone s f = false -> veh e = veh f -> e = f }.

Lemma in_queue s p e : sound s -> In e (queue s p) -> In e (book s p) /\ used s e = true /\ gone s e = false.
Proof.
  intros I H. rewrite (i_queue _ I) in H. apply filter_In in H. destruct H as [H E]. apply andb_prop in E. destruct E as [E1 E2].
  apply negb_true_iff in E2. auto.
Qed.

Ltac unchanged I := try solve [exact (i_place _ I)|exact (i_once _ I)|exact (i_room _ I)|exact (i_last _ I)|exact (i_known _ I)|exact (i_queue _ I)
  |exact (i_used _ I)|exact (i_out _ I)|exact (i_rears _ I)|exact (i_space _ I)|exact (i_asked _ I)|exact (i_one _ I)].

Lemma sound_ask f s : sound s -> stands f = wants (src f) -> veh f = veh (src f) -> hd_error (queue s (stands (src f))) = Some (src f) ->
  granted s f = false -> used s f = false -> gone s f = false -> sound (ask f s).
Proof.
  intros I H1 H2 H3 H4 H5 H6. destruct (in_queue s _ _ I (first_in _ _ H3)) as (B & U & G).
  constructor; unchanged I. simpl. intros e. cases; [auto 10|]. apply (i_asked _ I).
Qed.

Lemma sound_give_up f s : sound s -> used s f = false -> sound (give_up f s).
Proof.
  intros I H. assert (Se : forall l, settled s l -> settled (give_up f s) l).
  { intros l L e Ie. simpl. cases; auto. }
  constructor; unchanged I; simpl.
  - intros p K. destruct (i_last _ I p K). auto.
  - intros p. destruct (i_known _ I p) as (l & m & E & L & S). exists l, m. auto.
  - intros p. rewrite (i_queue _ I p). apply filter_ext. intro e. cases; auto. rewrite H. auto.
  - intros e. cases; auto. apply (i_out _ I).
  - intros e p Ie. cases; auto. apply (i_rears _ I _ _ Ie).
  - intros e Ge. cases; [discriminate|]. apply (i_space _ I); auto.
  - intros e Ae. destruct (i_asked _ I e Ae) as (H1 & H2 & H3 & H4). repeat split; auto.
    assert (Nf : src e <> f) by congruence. cases; auto; contradiction.
  - intros e e'. cases; try discriminate. apply (i_one _ I).
Qed.

Lemma sound_leave e s : sound s -> gone s e = true -> sound (leave e s).
Proof.
  intros I H. constructor; unchanged I; simpl.
  - intros x. cases; auto. apply (i_out _ I).
  - intros x Gx. cases; [discriminate|]. apply (i_space _ I); auto.
Qed.

Lemma sound_say s t : sound s -> book t = book s -> rears t = rears s -> asked t = asked s -> granted t = granted s -> used t = used s ->
  gone t = gone s -> out t = out s -> queue t = queue s ->
  (forall p, length (book s p) + length (rears s p) + held t p <= slots p) ->
  (forall p, kept t p <> None -> S (length (book s p)) = slots p /\ settled s (book s p)) -> sound t.
Proof.
  intros I E1 E2 E3 E4 E5 E6 E7 E8 H K.
  constructor; unfold settled in *; rewrite ?E1, ?E2, ?E3, ?E4, ?E5, ?E6, ?E7, ?E8; try apply I; auto.
Qed.

Lemma sound_admit f s : sound s -> asked s f = true -> granted s f = false -> settled s (book s (stands f)) ->
  length (book s (stands f)) + length (rears s (stands f)) < slots (stands f) -> sound (admit f s).
Proof.
  intros I H1 H2 H3 H4.
  assert (New : forall p, ~ (In f (book s p) \/ In f (rears s p))).
  { intros p J. destruct (i_place _ I _ _ J). congruence. }
  assert (Nu : used s f = false) by (destruct (used s f) eqn:E; auto; rewrite (i_used _ I f E) in H2; discriminate).
  constructor; unchanged I; simpl.
  - intros e p H. assert (H' : e = f /\ p = stands f \/ In e (book s p) \/ In e (rears s p)).
    { revert H. cases; auto. intros [H|H]; auto. apply in_app_or in H. destruct H as [H|[<-|[]]]; auto. }
    destruct H' as [[-> ->]|H']; [cases; auto; contradiction|]. destruct (i_place _ I _ _ H'). cases; auto.
  - intros p. cases; [|apply I]. rewrite <- app_assoc. simpl. apply NoDup_Add with (a := f) (l := book s (stands f) ++ rears s (stands f)).
    + apply Add_app.
    + split; [apply I|]. intro J. apply in_app_or in J. apply (New _ J).
  - intros p. unfold held; simpl. cases; [|apply I]. rewrite app_length. simpl. lia.
  - intros p. cases; [congruence|]. apply I.
  - intros p. cases; [|apply I]. exists (book s (stands f)), [f]. auto.
  - intros p. rewrite (i_queue _ I p). cases; auto. rewrite filter_app. simpl. rewrite Nu. simpl. rewrite app_nil_r. auto.
  - intros e U. cases; auto. apply I; auto.
  - intros e Ge Oe. destruct (Nat.eq_dec e f) as [->|Ne].
    { left. unfold upd. destruct (Nat.eq_dec (stands f) (stands f)); [|contradiction]. apply in_or_app. right. left. auto. }
    assert (H : granted s e = true) by (revert Ge; cases; auto; contradiction).
    clear Ge. destruct (i_space _ I e H Oe) as [J|J]; auto. left. cases; auto. apply in_or_app. left. congruence.
Qed.

Lemma nodup_left {A} (l m : list A) : NoDup (l ++ m) -> NoDup l.
Proof. induction l; simpl; intro N; constructor; inversion N; auto. rewrite in_app_iff in *. auto. Qed.

Lemma remove_once e (l : list nat) : NoDup l -> In e l -> S (length (remove Nat.eq_dec e l)) = length l.
Proof.
  induction 1 as [|x l N D IH]; intros []; simpl.
  - subst. destruct (Nat.eq_dec e e); [|contradiction]. rewrite notin_remove; auto.
  - destruct (Nat.eq_dec e x); [subst; contradiction|]. simpl. rewrite IH; auto.
Qed.

Lemma remove_nodup e (l : list nat) : NoDup l -> NoDup (remove Nat.eq_dec e l).
Proof.
  induction 1 as [|x l N D IH]; simpl; [constructor|]. destruct (Nat.eq_dec e x); auto. constructor; auto.
  intro H. apply in_remove in H. tauto.
Qed.

Lemma filter_removed (g : nat -> bool) e l : g e = false -> filter g (remove Nat.eq_dec e l) = filter g l.
Proof.
  intro H. induction l as [|x l IH]; simpl; auto. destruct (Nat.eq_dec e x); simpl; [subst; rewrite H; auto|]. rewrite IH. auto.
Qed.

Lemma sound_hear_gone e p s : sound s -> In e (book s p) -> gone s e = true -> sound (hear_gone e p s).
Proof.
  intros I H G. assert (N := i_once _ I p). assert (Nb : NoDup (book s p)) by (apply nodup_left in N; auto).
  assert (Nr : ~ In e (rears s p)).
  { intro J. apply in_split in H. destruct H as (l & m & E). rewrite E in N. rewrite <- app_assoc in N. simpl in N.
    apply NoDup_remove_2 in N. apply N. rewrite !in_app_iff. auto. }
  assert (L := remove_once e _ Nb H).
  constructor; unchanged I; simpl.
  - intros x r J. apply (i_place _ I). revert J. cases; auto. intros [J|[<-|J]]; auto. left. apply in_remove in J. tauto.
  - intros r. cases; [|apply I].
    apply NoDup_Add with (a := e) (l := remove Nat.eq_dec e (book s p) ++ rears s p); [apply Add_app|]. split.
    + rewrite <- (notin_remove Nat.eq_dec (rears s p) e Nr). rewrite <- remove_app. apply remove_nodup; auto.
    + intro J. apply in_app_or in J. destruct J as [J|J]; auto. apply remove_In in J. auto.
  - intros r. unfold held; simpl. assert (Q := i_room _ I r). unfold held in Q. cases; auto. simpl. destruct (kept s p); lia.
  - intros r. unfold settled; simpl. cases; [congruence|]. apply I.
  - intros r. destruct (i_known _ I r) as (l & m & E & Se & Le). unfold settled in *; simpl. cases; [|exists l, m; auto].
    exists (remove Nat.eq_dec e l), (remove Nat.eq_dec e m). rewrite E, remove_app. split; auto. split.
    + intros x J. apply in_remove in J. apply Se. tauto.
    + assert (Q := remove_length_le Nat.eq_dec m e). lia.
  - intros r. rewrite (i_queue _ I r). cases; auto. rewrite filter_removed; auto. rewrite G. destruct (used s e); auto.
  - intros x r. cases; [|apply I]. intros [<-|J]; auto. eapply (i_rears _ I); eauto.
  - intros x Gx Ox. destruct (i_space _ I x Gx Ox) as [J|J]; unfold upd; destruct (Nat.eq_dec (stands x) p) as [Ep|Np]; auto; rewrite Ep in *.
    + destruct (Nat.eq_dec x e); [right; left; auto|left]. apply in_in_remove; auto.
    + right. right. auto.
Qed.

Lemma sound_hear_out e p s : sound s -> In e (rears s p) -> out s e = true -> sound (hear_out e p s).
Proof.
  intros I H O. assert (N := i_once _ I p).
  constructor; unchanged I; simpl.
  - intros x r J. apply (i_place _ I). revert J. cases; auto. intros [J|J]; auto. apply in_remove in J. tauto.
  - intros r. cases; [|apply I]. assert (Nb : ~ In e (book s p)).
    { intro J. apply in_split in H. destruct H as (l & m & E). rewrite E in N.
      apply (NoDup_remove_2 (book s p ++ l) m e); [rewrite <- app_assoc; auto|]. rewrite !in_app_iff. auto. }
    rewrite <- (notin_remove Nat.eq_dec (book s p) e Nb), <- remove_app. apply remove_nodup; auto.
  - intros r. assert (Q := i_room _ I r). unfold held in *; simpl. cases; auto.
    assert (W := remove_length_le Nat.eq_dec (rears s p) e). lia.
  - intros x r. cases; [|apply I]. intro J. apply in_remove in J. eapply (i_rears _ I); apply J.
  - intros x Gx Ox. destruct (i_space _ I x Gx Ox) as [J|J]; auto. right. cases; auto. rewrite e0 in *.
    apply in_in_remove; auto. congruence.
Qed.

Lemma sound_go f rest s : sound s -> asked s f = true -> granted s f = true -> used s f = false -> gone s f = false ->
  queue s (stands (src f)) = src f :: rest -> sound (go f rest s).
Proof.
  intros I Af Gf Uf Nf Q. set (a := src f) in *.
  destruct (i_asked _ I f Af) as (Wf & Vf & Ua & _). fold a in Wf, Vf, Ua.
  assert (Qa : In a (queue s (stands a))) by (rewrite Q; left; auto).
  destruct (in_queue _ _ _ I Qa) as (Ba & _ & Na).
  assert (Df : stands f <> stands a) by (rewrite Wf; apply no_self).
  assert (Naf : a <> f) by congruence.
  assert (Sib : forall e, asked s e = true -> src e = a -> used s e = true -> gone s e = true).
  { intros e Ae Se Ue. destruct (i_asked _ I e Ae) as (_ & _ & _ & [?|[[_ X]|(X & _)]]); auto; congruence. }
  set (g := gone (go f rest s)).
  assert (Gd : forall e, g e = true <-> gone s e = true \/ e = a \/ (asked s e = true /\ src e = a /\ e <> f)).
  { intro e. unfold g; simpl. fold a. rewrite !orb_true_iff, !andb_true_iff.
    destruct (Nat.eq_dec e a), (Nat.eq_dec (src e) a), (Nat.eq_dec e f); intuition congruence. }
  assert (Gm : forall e, gone s e = true -> g e = true) by (intros; apply Gd; auto).
  assert (Gf' : g f = false) by (apply not_true_iff_false; rewrite Gd; intros [?|[?|[_ [_ ?]]]]; congruence).
  assert (Se : forall l, settled s l -> settled (go f rest s) l).
  { intros l L e J. destruct (L e J); [left; simpl; cases; auto|right; apply Gm; auto]. }
  set (lv := fun e => used (go f rest s) e && negb (g e)).
  assert (Lf : lv f = true) by (unfold lv; rewrite Gf'; simpl; unfold upd; destruct (Nat.eq_dec f f); [auto|contradiction]).
  assert (La : lv a = false) by (unfold lv; rewrite (proj2 (Gd a)); auto; apply andb_false_r).
  assert (Live : forall e, e <> f -> e <> a -> lv e = used s e && negb (gone s e)).
  { intros e Ne Na'. unfold lv. assert (U : used (go f rest s) e = used s e) by (simpl; cases; congruence). rewrite U.
    destruct (used s e) eqn:Ue; auto. simpl. f_equal. destruct (gone s e) eqn:Ge; [apply Gm; auto|].
    apply not_true_iff_false. rewrite Gd. intros [?|[?|[X [Y _]]]]; try congruence. rewrite (Sib e X Y Ue) in Ge. discriminate. }

  constructor; unchanged I.
  - intros p K. destruct (i_last _ I p K). auto.
  - intros p. destruct (i_known _ I p) as (l & m & E & L & S). exists l, m. auto.
  - intros p. change (upd (upd (queue s) (stands a) rest) (stands f) (queue s (stands f) ++ [f]) p = filter lv (book s p)).
    unfold upd. destruct (Nat.eq_dec p (stands f)) as [->|Np].
    + destruct (i_space _ I f Gf) as [Bf|Bf].
      { destruct (out s f) eqn:O; auto. rewrite (i_out _ I f O) in Nf. discriminate. }
      2: { rewrite (i_rears _ I _ _ Bf) in Nf. discriminate. }
      destruct (i_known _ I (stands f)) as (l & m & E & L & S). rewrite (i_queue _ I), E in *.
      assert (Fl : ~ In f l) by (intro J; destruct (L f J); congruence).
      apply in_app_or in Bf. destruct Bf as [?|Bf]; [contradiction|]. destruct m as [|x m]; [destruct Bf|].
      destruct m; [|simpl in S; lia]. destruct Bf as [->|[]]. rewrite !filter_app. simpl. rewrite Uf, Lf. simpl.
      rewrite app_nil_r. f_equal. apply filter_ext_in. intros e J. symmetry. apply Live; [congruence|].
      intros ->. destruct (i_place _ I a (stands f)); [left; rewrite E; apply in_or_app; auto|congruence].
    + destruct (Nat.eq_dec p (stands a)) as [->|Npa].
      * assert (X : rest = remove Nat.eq_dec a (queue s (stands a))).
        { assert (N := i_once _ I (stands a)). apply nodup_left in N. assert (N2 := NoDup_filter (fun e => used s e && negb (gone s e)) N).
          rewrite <- (i_queue _ I), Q in N2. rewrite Q. simpl. destruct (Nat.eq_dec a a); [|contradiction].
          inversion N2. rewrite notin_remove; auto. }
        rewrite X, (i_queue _ I). clear X.
        assert (Al : forall e, In e (book s (stands a)) -> e <> f).
        { intros e J ->. destruct (i_place _ I f (stands a)); auto. }
        revert Al. generalize (book s (stands a)). intros l Al. induction l as [|x l IH]; auto. simpl.
        destruct (Nat.eq_dec x a) as [->|Nx].
        { rewrite Ua, Na, La. simpl. destruct (Nat.eq_dec a a); [|contradiction]. apply IH. intros; apply Al; right; auto. }
        rewrite Live; auto; [|apply Al; left; auto].
        destruct (used s x && negb (gone s x)); simpl; [destruct (Nat.eq_dec a x); [congruence|]; f_equal|];
          apply IH; intros; apply Al; right; auto.
      * rewrite (i_queue _ I). apply filter_ext_in. intros e J. symmetry.
        destruct (i_place _ I e p) as [Pe _]; auto. apply Live; intros ->; auto.
  - intros e U. simpl in *. revert U. cases; auto. intro. apply I; auto.
  - intros e O. apply Gm. apply (i_out _ I e O).
  - intros e p J. apply Gm. apply (i_rears _ I e p J).
  - intros e Ae. simpl in Ae. destruct (i_asked _ I e Ae) as (H1 & H2 & H3 & H4). split; auto. split; auto.
    split; [simpl; cases; auto|]. fold g. destruct H4 as [H4|[[H4 H5]|(H4 & H5 & H6)]]; auto.
    { right. left. split; auto. simpl. cases; auto. }
    destruct (Nat.eq_dec e f) as [->|Ne]; [right; left; split; [simpl; cases; congruence|apply Gd; auto]|].
    destruct (Nat.eq_dec (src e) a) as [Ea|Nea]; [left; apply Gd; auto|]. right. right.
    assert (Ns : stands (src e) <> stands a) by (intro X; rewrite X, Q in H6; simpl in H6; congruence).
    split; [simpl; cases; congruence|]. split.
    + apply not_true_iff_false. rewrite Gd. intros [?|[?|[X [Y _]]]]; try congruence. rewrite (Sib _ X Y H3) in H5. discriminate.
    + simpl. fold a. unfold upd. destruct (Nat.eq_dec (stands (src e)) (stands f)) as [X|X].
      * rewrite <- X. destruct (queue s (stands (src e))); [discriminate|auto].
      * destruct (Nat.eq_dec (stands (src e)) (stands a)); [contradiction|auto].
  - fold g. intros e e' U U' N N' V.
    assert (One : forall x, x <> f -> used (go f rest s) x = true -> g x = false -> veh x = veh f -> False).
    { intros x Nx Ux Gx Vx. assert (x = a); [|subst; rewrite (proj2 (Gd a)) in Gx; auto; discriminate].
      apply (i_one _ I); auto; try congruence; [revert Ux; simpl; cases; auto; congruence|].
      destruct (gone s x) eqn:X; auto. rewrite (Gm x X) in Gx. discriminate. }
    destruct (Nat.eq_dec e f) as [->|Ne], (Nat.eq_dec e' f) as [->|Ne']; auto; [exfalso; eauto|exfalso; eauto|].
    assert (K : forall x, x <> f -> used (go f rest s) x = true -> g x = false -> used s x = true /\ gone s x = false).
    { intros x Nx Ux Gx. split; [revert Ux; simpl; cases; auto; congruence|]. destruct (gone s x) eqn:X; auto. rewrite (Gm x X) in Gx. discriminate. }
    destruct (K e), (K e'); auto. apply (i_one _ I); auto.
Qed.
End Books.
